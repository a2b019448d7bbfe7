// Puts the charts together: messages of the server go to them, and one animation frame draws those that changed.

import { $, put } from "../dom.js";
import { clock } from "../formatting.js";
import { Viewport } from "./viewport.js";
import { Cursors } from "./readout.js";
import { Rows } from "./rows.js";
import { Annotations, fromRows, runningOf } from "./annotations.js";
import { StoryPlot } from "./story.js";
import { Detail, Overview } from "./timeline.js";

const PAN = 0.2; // by a key: a share of the window
const ZOOM = 0.5; // by a key: a factor
const EARLIER = 8; // touches behind the one that is shown
const LONGEST = [2, 5, 7, 10, 15, 20, 30, 60, 120, 300, 600]; // s, where the length of a touch is not known
const AROUND_S = 1.5; // Explain shows so much before and after a touch
const TOUCH_MS = 66;
const TOUCH = ["touchplot", "storyplot"];
const ALL = ["time", "fitplot", ...TOUCH];

export class Charts {
  // store: Store; known: the newest message of each kind; send(message): to the server; notify("looking" or "chosen"): the page
  constructor(store, known, send, notify) {
    Object.assign(this, { store, known, notify });
    this.dirty = new Set();
    this.annotations = new Annotations(known);
    this.rows = new Rows(store, known, send, () => this.redraw("time"));
    this.viewport = new Viewport(() => this.moved());
    this.cursors = new Cursors(
      $("readout"),
      this,
      (from_s, to_s) => this.viewport.file && send?.({ do: "cut", from_s, to_s }),
    );
    this.overview = new Overview($("overview"), this);
    this.detail = new Detail($("detail"), this);
    this.touchplot = new StoryPlot($("touchplot"), this, true);
    this.storyplot = new StoryPlot($("storyplot"), this);
    addEventListener("beforeprint", () => this.paint());
  }

  // `known` has another message of this kind; without one the theme or the size is another.
  show(type) {
    this.follow();
    this.redraw(...(type === "state" ? ["time"] : ALL));
  }

  clear(file) {
    this.annotations.clear();
    this.rows.clear();
    this.viewport.clear(file);
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
    const { begin, end } = this.rows.extent;
    const { state } = this.known;
    Object.assign(this.viewport, { begin, end });
    const running = this.viewport.file
      ? null
      : runningOf(this.store, this.annotations.touches.at(-1));
    this.annotations.running = running && {
      ...running,
      specimen: state.on ?? null,
      uncertainty: state.uncertainty ?? null,
    };
  }

  // Shows a touch; null: the running or the newest one. The window of a file goes to it, or to another moment, if that is given.
  choose(number, moment = null) {
    this.known.chosen = number;
    const touch = this.viewport.file ? this.annotations.touches[number - 1] : null;
    const around = moment ?? touch;
    if (around) this.viewport.around(around);
    this.notify("chosen");
    this.redraw("touchplot", "storyplot");
  }

  // In the Lab the arrows move the window; in Explain, and in Measure of a file, they go from touch to touch.
  key(name) {
    const { viewport, cursors } = this;
    const { from, to } = viewport;
    const here = this.detail.pointer ?? (from + to) / 2;
    const { depth } = document.body.dataset;
    switch (name) {
      case "left":
        return depth === "lab" ? viewport.pan(-PAN * (to - from)) : this.step(-1);
      case "right":
        return depth === "lab" ? viewport.pan(PAN * (to - from)) : this.step(1);
      case "in":
        return viewport.zoomHere(ZOOM);
      case "out":
        return viewport.zoomHere(1 / ZOOM);
      case "all":
        return viewport.live(Infinity);
      case "pause":
        return viewport.show(from, to);
      case "live":
        cursors.clear();
        this.choose(null);
        return viewport.now();
      case "cursor a":
        return cursors.put(0, here);
      case "cursor b":
        return cursors.put(1, here);
      case "clear":
        return cursors.clear();
    }
  }

  // The touch that is chosen, else the running or the newest one.
  get touch() {
    const { touches, all } = this.annotations;
    return touches.find(({ number }) => number === this.known.chosen) ?? all.at(-1) ?? null;
  }

  // The touch before or after the one that is shown, of those that are found in a file; null: there is none.
  neighbour(by) {
    const here = this.touch?.number;
    const among = this.known.found ?? this.annotations.all;
    if (by > 0) return among.find(({ number }) => number > here) ?? null;
    return among.findLast(({ number }) => number < here) ?? null;
  }

  // Goes there. The running touch is shown by choosing none; Measure of a running measurement shows no other.
  step(by) {
    if (document.body.dataset.depth === "measure" && !this.viewport.file) return;
    const touch = this.neighbour(by);
    if (touch) this.choose(touch.running ? null : touch.number);
  }

  // What Explain shows: a touch with what was before and after it; block: null while its rows are on their way.
  story(around = AROUND_S) {
    const { touch } = this;
    if (!touch) return null;
    const last = touch.end_s - touch.start_s;
    const usual = this.known.hello.seconds ?? LONGEST.find((seconds) => seconds >= last) ?? last;
    const from = touch.start_s - around;
    const to = touch.start_s + Math.max(touch.running ? usual : last, last) + around;
    const pins = this.annotations.pinsOf(touch, from, to);
    return { touch, from, to, pins, block: this.rowsOf(touch), curve: this.curveOf(touch) };
  }

  // What the Lab shows: the touch alone, and the touches before on the same specimen.
  labStory() {
    const story = this.story(0);
    if (!story) return null;
    const { number, specimen } = story.touch;
    const alike = this.annotations.touches.filter((one) => {
      return one.kept && specimen && one.specimen === specimen && one.number < number;
    });
    const curves = alike.slice(-EARLIER).map((one) => this.curveOf(one));
    return { ...story, earlier: curves.filter((curve) => curve.length > 1) };
  }

  curveOf(touch) {
    const block = this.rowsOf(touch);
    return block ? fromRows(block, touch.start_s, touch.end_s) : [];
  }

  // Rows of a touch and of what is around it: those that are here, or a view, which is requested once. null: on its way.
  rowsOf({ number, start_s, end_s, running }) {
    const from = start_s - AROUND_S;
    if (running || (this.store.used && from >= this.rows.extent.held)) return this.store.block;
    const { blocks } = this.annotations;
    if (blocks.has(number)) return blocks.get(number);
    if (this.store.used && start_s >= this.rows.extent.held) return this.store.block;
    this.rows.once(`touch ${number}`, from, end_s + AROUND_S, (block) => {
      this.annotations.keep(number, block);
      this.redraw(...TOUCH);
    });
    return null;
  }

  moved() {
    const { fixed, file } = this.viewport;
    this.known.looking = fixed && !file ? { from_s: fixed[0], to_s: fixed[1] } : null;
    this.notify("looking");
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
    for (const part of dirty) {
      if (part === "time") this.paintTime();
      else this[part]?.draw();
    }
  }

  paintTime() {
    const { begin, end } = this.rows.extent;
    const { from, to } = this.viewport;
    this.overview.draw();
    this.cursors.draw();
    this.detail.draw();
    const part = `${clock(from - begin)} to ${clock(to - begin)} of ${clock(end - begin)}`;
    put("timetitle", this.viewport.file ? part : `Timeline · ${part}`);
  }
}
