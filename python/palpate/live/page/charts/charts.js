// Puts the charts together: what the server tells goes to them, and one animation frame draws those that changed.

import { fromRows, fromTrace, runningOf } from "./curves.js";
import { Detail } from "./detail.js";
import { Looking } from "./looking.js";
import { Multiples } from "./multiples.js";
import { Overview } from "./overview.js";
import { Cursors } from "./readout.js";
import { Rows } from "./rows.js";
import { Tale } from "./tale.js";
import { clock } from "./ticks.js";
import { TouchPlot } from "./touch.js";

const PAN = 0.2, ZOOM = 0.5, EARLIER = 8; // by a key: a share of the window, a factor; touches behind the shown one
const TOUCH_MS = 66;

export class Charts {
  // document: with the places of the charts; store: Store; say(message): to the server; others: what a page has beside
  // them, name -> class of it
  constructor(document, store, say, others = {}) {
    Object.assign(this, { document, store, say });
    const place = (id) => document.getElementById(id), redraw = () => this.redraw("time", "touch");
    this.dirty = new Set();
    this.hello = {};
    this.chosen = null;
    this.asked = new Set(); // traces that were asked for
    this.tale = new Tale();
    this.rows = new Rows(store, say, () => this.redraw("time"));
    this.window = new Looking(() => this.moved());
    this.cursors = new Cursors(place("readout"), { rows: this.rows, tale: this.tale, changed: () => this.redraw("time") });
    const parts = { rows: this.rows, looking: this.window, tale: this.tale, cursors: this.cursors, choose: (n) => this.choose(n), redraw: () => this.redraw("time"), say };
    this.overview = new Overview(place("overview"), parts);
    this.detail = new Detail(place("detail"), parts);
    this.touchplot = new TouchPlot(place("touchplot"), { subject: () => this.subject(), settings: () => this.settings, redraw });
    this.multiples = new Multiples(place("multiples"), { touches: () => this.tale.all, curveOf: (one) => this.curveOf(one), settings: () => this.settings, choose: parts.choose, redraw });
    for (const [name, Other] of Object.entries(others)) this[name] = new Other(place(name), { say, redraw: () => this.redraw(name) });
    this.timetitle = place("timetitle");
    addEventListener("beforeprint", () => this.paint());
  }

  // null: the window follows the measurement.
  get looking() {
    return this.window.back;
  }

  get settings() {
    const { threshold = null, seconds = null, scatter, probe } = this.hello;
    return { threshold, seconds, scatter: scatter ?? probe?.scatter ?? null };
  }

  // A message of the server.
  tell(type, message) {
    this[`tell_${type}`]?.(message);
  }

  tell_hello(message) {
    const same = (name) => message[name] === this.hello[name];
    if (!same("measurement") || !same("kind") || (this.hello.origin_s !== null && !same("origin_s"))) this.clear(message.kind === "file");
    this.hello = message;
    if (this.spectrum?.on) this.say({ do: "noise", on: true }); // a new connection
    this.rows.told.begin = message.origin_s ?? null;
    this.overview.changed();
    this.redraw("time", "touch");
  }

  clear(file) {
    this.tale.clear();
    this.rows.clear();
    this.window.clear(file);
    this.cursors.clear();
    this.asked.clear();
    this.chosen = null;
  }

  tell_state({ end_s: end = null, uncertainty = null }) {
    this.tale.uncertainty = uncertainty;
    if (end === this.rows.told.end) return;
    this.rows.told.end = end;
    this.follow();
    this.redraw("time");
  }

  tell_touches({ rows }) {
    this.tale.touches = rows;
    this.follow();
    this.overview.changed();
    this.redraw("time", "touch");
  }

  // The specimen of a touch that goes on is the next one of the plan.
  tell_session({ next }) {
    this.tale.next = next?.name ?? null;
    this.follow();
    this.redraw("touch");
  }

  tell_trace(message) {
    this.tale.traces.set(message.touch, fromTrace(message));
    this.redraw("touch");
  }

  tell_events({ marks = [], tares = [], gaps = [], flags = [] }) {
    this.tale.events = { marks, tares, gaps, flags };
    this.overview.changed();
    this.redraw("time", "touch");
  }

  tell_calibration(message) {
    if (!this.fitplot) return;
    this.fitplot.calibration = message?.points ? message : null;
    this.redraw("fitplot");
  }

  tell_noise(message) {
    if (!this.spectrum) return;
    this.spectrum.noise = message?.hz ? message : null;
    this.redraw("spectrum");
  }

  // New rows have come. The charts of touches, which are more work, follow some times a second.
  frame() {
    this.follow();
    this.redraw("time");
    this.later ??= setTimeout(() => {
      this.later = null;
      this.redraw("touch");
    }, TOUCH_MS);
  }

  follow() {
    const { begin, end } = this.rows.extent;
    Object.assign(this.window, { begin, end });
    const running = this.window.file ? null : runningOf(this.store, this.tale.touches.at(-1));
    this.tale.running = running && { ...running, specimen: this.tale.next, uncertainty: this.tale.uncertainty };
  }

  // The theme or the size is another.
  dress() {
    this.overview.dress();
    this.detail.dress();
    this.redraw("time", "touch", "fitplot", "spectrum");
  }

  // Shows a touch; null: the running or the newest one.
  choose(number) {
    this.chosen = number;
    this.document.dispatchEvent(new CustomEvent("chosen", { detail: number }));
    this.redraw("touch");
  }

  key(name) {
    const { window: looking, cursors } = this, [from, to] = [looking.from, looking.to];
    const act = {
      "left": () => looking.pan(-PAN * (to - from)), "right": () => looking.pan(PAN * (to - from)),
      "in": () => looking.zoomHere(ZOOM), "out": () => looking.zoomHere(1 / ZOOM),
      "all": () => looking.live(Infinity), "pause": () => looking.pause(),
      "live": () => { cursors.clear(); this.choose(null); looking.now(); },
      "cursor a": () => this.put(0), "cursor b": () => this.put(1), "clear": () => cursors.clear(),
      "spectrum": () => this.spectrum?.toggle(),
    }[name];
    act?.();
    return Boolean(act);
  }

  // A cursor goes to the pointer, or to the middle of the window.
  put(which) {
    this.cursors.put(which, this.detail.pointer ?? (this.window.from + this.window.to) / 2);
  }

  // What the touch chart shows.
  subject() {
    const touch = (this.chosen !== null && this.tale.touch(this.chosen)) || this.tale.all.at(-1);
    if (!touch) return null;
    const alike = this.tale.touches.filter((one) => one.kept && one.specimen && one.specimen === touch.specimen && one.number < touch.number);
    const earlier = alike.slice(-EARLIER).map((one) => this.curveOf(one)).filter((curve) => curve.length > 1);
    return { touch, curve: this.curveOf(touch), earlier, flags: this.tale.flagsOf(touch.number) };
  }

  // From the server's trace; else from the rows that are here; else it is asked for.
  curveOf({ number, start_s: start, end_s: end, running }) {
    const trace = running ? null : this.tale.traces.get(number);
    if (trace) return trace;
    if (start >= this.rows.extent.held && this.store.used) return fromRows(this.store, start, end);
    if (!this.asked.has(number) && this.say({ do: "trace", touch: number }) !== false) this.asked.add(number);
    return [];
  }

  moved() {
    const back = this.looking, said = JSON.stringify(back);
    if (said !== this.said) this.document.dispatchEvent(new CustomEvent("looking", { detail: back }));
    this.said = said;
    this.redraw("time");
  }

  // Draws in the next animation frame, once.
  redraw(...parts) {
    if (!this.dirty.size) requestAnimationFrame(() => this.paint());
    for (const part of parts) this.dirty.add(part);
  }

  paint() {
    const all = { time: () => this.paintTime(), touch: () => { this.touchplot.draw(); this.multiples.draw(); } };
    const dirty = [...this.dirty];
    this.dirty.clear();
    for (const part of dirty) (all[part] ?? (() => this[part]?.draw()))();
  }

  paintTime() {
    const { begin, end } = this.rows.extent, { from, to } = this.window;
    this.overview.draw();
    this.cursors.draw();
    this.detail.draw();
    const text = `Timeline · ${clock(from - begin)} to ${clock(to - begin)} of ${clock(end - begin)}`;
    if (this.timetitle && this.timetitle.textContent !== text) this.timetitle.textContent = text;
  }

  // What was drawn, for tests.
  geometry() {
    const { window: looking, overview, detail, touchplot, rows } = this;
    return {
      from: looking.from, to: looking.to, back: looking.back, extent: rows.extent, requests: rows.views.sent,
      overview: { labels: overview.labels, points: overview.points, width: overview.sheet.width, height: overview.sheet.height },
      detail: { labels: detail.labels, points: detail.points, left: detail.left, right: detail.right, top: detail.top, foot: detail.foot, width: detail.sheet.width, height: detail.sheet.height },
      touch: { labels: touchplot.shown?.labels ?? [], scale: touchplot.shown?.scale ?? null, number: touchplot.shown?.touch.number ?? null, points: touchplot.shown?.curve.length ?? 0 },
      cursors: this.cursors.values,
    };
  }
}
