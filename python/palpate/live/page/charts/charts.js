// Puts the charts together: what the server tells goes to them, and one animation frame draws those that changed.

import { $, put } from "../dom.js";
import { clock } from "../formatting.js";
import { Looking } from "./looking.js";
import { Cursors } from "./readout.js";
import { Rows } from "./rows.js";
import { Tale, fromRows, runningOf } from "./tale.js";
import { Detail, Overview } from "./timeline.js";
import { Intervals, TouchPlot } from "./touch.js";

const PAN = 0.2, ZOOM = 0.5, EARLIER = 8; // by a key: a share of the window, a factor; touches behind the shown one
const TOUCH_MS = 66;
const TOUCH = ["touchplot", "intervals"], ALL = ["time", "fitplot", ...TOUCH];

export class Charts {
  // store: Store; known: the newest message of each kind; say(message): to the server; tell("looking" or "chosen"): to the page
  constructor(store, known, say, tell) {
    Object.assign(this, { store, known, tell, dirty: new Set(), tale: new Tale(known) });
    this.rows = new Rows(store, known, say, () => this.redraw("time"));
    this.window = new Looking(() => this.moved());
    this.cursors = new Cursors($("readout"), this, (from_s, to_s) => this.window.file && say?.({ do: "cut", from_s, to_s }));
    this.overview = new Overview($("overview"), this);
    this.detail = new Detail($("detail"), this);
    this.touchplot = new TouchPlot($("touchplot"), this);
    this.intervals = new Intervals($("intervals"), this);
    addEventListener("beforeprint", () => this.paint());
  }

  // `known` has another message of this kind; without one the theme or the size is another.
  show(type) {
    this.follow();
    this.redraw(...(type === "state" ? ["time"] : ALL));
  }

  clear(file) {
    this.tale.clear();
    this.rows.clear();
    this.window.clear(file);
    this.cursors.clear();
  }

  // New rows have come. The charts of touches, which are more work, follow some times a second.
  frame() {
    this.follow();
    this.redraw("time");
    this.later ??= setTimeout(() => {
      this.later = null;
      this.redraw(...TOUCH);
    }, TOUCH_MS);
  }

  // The touch that goes on, and what it will be stored with.
  follow() {
    const { begin, end } = this.rows.extent, { state } = this.known;
    Object.assign(this.window, { begin, end });
    const running = this.window.file ? null : runningOf(this.store, this.tale.touches.at(-1));
    this.tale.running = running && { ...running, specimen: state.on ?? null, uncertainty: state.uncertainty ?? null };
  }

  // Shows a touch; null: the running or the newest one. The window of a file goes to it.
  choose(number) {
    this.known.chosen = number;
    const touch = this.window.file && this.tale.touches[number - 1];
    if (touch) this.window.around(touch);
    this.tell("chosen");
    this.redraw("touchplot");
  }

  key(name) {
    const { window: looking, cursors } = this, { from, to } = looking, here = this.detail.pointer ?? (from + to) / 2;
    const act = {
      "left": () => looking.pan(-PAN * (to - from)), "right": () => looking.pan(PAN * (to - from)),
      "in": () => looking.zoomHere(ZOOM), "out": () => looking.zoomHere(1 / ZOOM),
      "all": () => looking.live(Infinity), "pause": () => looking.show(from, to),
      "live": () => { cursors.clear(); this.choose(null); looking.now(); },
      "cursor a": () => cursors.put(0, here), "cursor b": () => cursors.put(1, here), "clear": () => cursors.clear(),
    }[name];
    act?.();
  }

  // What the touch chart shows.
  subject() {
    const touch = this.tale.touches.find(({ number }) => number === this.known.chosen) ?? this.tale.all.at(-1);
    if (!touch) return null;
    const alike = this.tale.touches.filter((one) => one.kept && one.specimen && one.specimen === touch.specimen && one.number < touch.number);
    const earlier = alike.slice(-EARLIER).map((one) => this.curveOf(one)).filter((curve) => curve.length > 1);
    return { touch, curve: this.curveOf(touch), earlier, flags: this.tale.events.flags.filter((flag) => flag.touch === touch.number) };
  }

  // From a view of it; else from the rows that are here; else a view is asked for.
  curveOf({ number, start_s: start, end_s: end, running }) {
    const { courses } = this.tale;
    if (!running && courses.has(number)) return courses.get(number);
    if (start >= this.rows.extent.held && this.store.used) return fromRows(this.store.block, start, end);
    this.rows.once(`touch ${number}`, start, end, (block) => {
      courses.set(number, fromRows(block, start, end));
      this.redraw("touchplot");
    });
    return [];
  }

  moved() {
    const { fixed, file } = this.window;
    this.known.looking = fixed && !file ? { from_s: fixed[0], to_s: fixed[1] } : null;
    this.tell("looking");
    this.redraw("time");
  }

  // Draws in the next animation frame, once.
  redraw(...parts) {
    if (!this.dirty.size) requestAnimationFrame(() => this.paint());
    for (const part of parts) this.dirty.add(part);
  }

  paint() {
    const dirty = [...this.dirty];
    this.dirty.clear();
    for (const part of dirty) if (part === "time") this.paintTime(); else this[part]?.draw();
  }

  paintTime() {
    const { begin, end } = this.rows.extent, { from, to } = this.window;
    this.overview.draw();
    this.cursors.draw();
    this.detail.draw();
    put("timetitle", `${this.window.file ? "" : "Timeline · "}${clock(from - begin)} to ${clock(to - begin)} of ${clock(end - begin)}`);
  }
}
