// Puts the charts together: what the server tells goes to them, and one animation frame draws those that changed.

import { $, put } from "../dom.js";
import { clock } from "../formatting.js";
import { Looking } from "./looking.js";
import { Multiples } from "./multiples.js";
import { Cursors } from "./readout.js";
import { Rows } from "./rows.js";
import { Tale, fromRows, fromTrace, runningOf } from "./tale.js";
import { Detail, Overview } from "./timeline.js";
import { TouchPlot } from "./touch.js";

const PAN = 0.2, ZOOM = 0.5, EARLIER = 8; // by a key: a share of the window, a factor; touches behind the shown one
const TOUCH_MS = 66;

export class Charts {
  // store: Store; say(message): to the server; others: what a page has in addition
  // them, name -> class of it
  constructor(store, say, others = {}) {
    Object.assign(this, { store, say });
    this.dirty = new Set();
    this.hello = {};
    this.chosen = null;
    this.asked = new Set(); // traces that were asked for
    this.tale = new Tale();
    this.rows = new Rows(store, say, () => this.redraw("time"));
    this.window = new Looking(() => this.moved());
    this.cursors = new Cursors($("readout"), { rows: this.rows, tale: this.tale, changed: () => this.redraw("time") });
    const parts = { rows: this.rows, looking: this.window, tale: this.tale, cursors: this.cursors, choose: (n) => this.choose(n), redraw: () => this.redraw("time") };
    this.overview = new Overview($("overview"), parts);
    this.detail = new Detail($("detail"), parts);
    this.touchplot = new TouchPlot($("touchplot"), this, "touch");
    this.multiples = new Multiples($("multiples"), this, "touch");
    this.others = Object.entries(others).map(([name, Other]) => (this[name] = new Other($(name), this, name)));
    addEventListener("beforeprint", () => this.paint());
  }

  // A message of the server.
  tell(type, message) {
    for (const part of [this, ...this.others]) part[`tell_${type}`]?.(message);
  }

  tell_hello(message) {
    const same = (name) => message[name] === this.hello[name];
    if (!same("measurement") || !same("kind") || (this.hello.origin_s !== null && !same("origin_s"))) this.clear(message.kind === "file");
    this.hello = message;
    this.asked.clear(); // perhaps on a new connection
    this.rows.told.begin = message.origin_s ?? null;
    this.redraw("time", "touch");
  }

  clear(file) {
    this.tale.clear();
    this.rows.clear();
    this.window.clear(file);
    this.cursors.clear();
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
    Object.assign(this.tale, { marks, tares, gaps, flags });
    this.redraw("time", "touch");
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
    document.dispatchEvent(new CustomEvent("chosen", { detail: number }));
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
    const { back } = this.window, said = JSON.stringify(back);
    if (said !== this.said) document.dispatchEvent(new CustomEvent("looking", { detail: back }));
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
    put("timetitle", `Timeline · ${clock(from - begin)} to ${clock(to - begin)} of ${clock(end - begin)}`);
  }
}
