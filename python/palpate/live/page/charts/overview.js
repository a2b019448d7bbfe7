// The whole measurement as one strip: touches, marks, gaps, tares, and the window, which can be dragged.

import { Hover } from "./hover.js";
import { placed } from "./labels.js";
import { GAP_S, extremes } from "./plot.js";
import { gestures } from "./pointers.js";
import { Sheet } from "./sheet.js";
import { clock } from "./ticks.js";

const EVERY_MS = 250; // the strip itself is drawn anew; the window on it in every frame
const HANDLE = 8; // pixels
const STALE = 0.02; // share of the measurement that may be missing in the view of everything

export class Overview {
  // rows: Rows, looking: Looking, tale: Tale, choose(number of a touch), redraw()
  constructor(place, { rows, looking, tale, choose, redraw }) {
    Object.assign(this, { place, rows, looking, tale, choose, redraw });
    this.sheet = new Sheet(place, () => this.dress());
    this.strip = document.createElement("canvas");
    this.hover = new Hover(place);
    this.drawn = { at: -Infinity, of: "" };
    this.labels = [];
    this.selected = null;
    gestures(place, {
      grab: (x) => this.grab(x),
      selecting: (a, b) => this.select(a, b),
      select: (a, b) => looking.show(this.time(a), this.time(b)),
      click: (x) => this.click(x),
      hover: (x) => this.tell(x),
      zoom: (factor, x) => looking.zoom(factor, this.time(x)),
      slide: (pixels) => looking.pan((pixels / this.sheet.width) * (this.until - this.since)),
    });
  }

  // Colours or size are others.
  dress() {
    this.sheet.dress();
    this.changed();
  }

  changed() {
    this.drawn = { at: -Infinity, of: "" };
    this.redraw();
  }

  x(t) {
    return ((t - this.since) / (this.until - this.since)) * this.sheet.width;
  }

  time(x) {
    return this.since + (Math.max(0, Math.min(this.sheet.width, x)) / this.sheet.width) * (this.until - this.since);
  }

  // Inside the window: it is dragged; at its edges: they are; elsewhere: a part is selected.
  grab(x) {
    const { from, to } = this.looking, [a, b] = [this.x(from), this.x(to)];
    if (Math.abs(x - a) < HANDLE && b - a > 3 * HANDLE) return (to_x) => this.looking.show(Math.min(this.time(to_x), to - 0.01), to);
    if (Math.abs(x - b) < HANDLE && b - a > 3 * HANDLE) return (to_x) => this.looking.show(from, Math.max(this.time(to_x), from + 0.01));
    if (x < a - HANDLE || x > b + HANDLE || b - a > 0.98 * this.sheet.width) return null;
    return (_, dx) => this.looking.pan((dx / this.sheet.width) * (this.until - this.since));
  }

  select(a, b) {
    this.selected = a === null ? null : [Math.min(a, b), Math.max(a, b)];
    this.redraw();
  }

  // The window goes to where it is clicked, and the touch there is shown.
  click(x) {
    const t = this.time(x), { from, to } = this.looking, touch = this.tale.touchAt(t, this.time(x + 4) - t);
    const half = Math.min(to - from, Math.max(30, 0.1 * (to - from))) / 2;
    if (touch) this.choose(touch.number);
    this.looking.show(t - half, t + half);
  }

  tell(x) {
    if (x === null || !this.until) return this.hover.hide();
    const t = this.time(x), near = this.time(x + 4) - t;
    const [low, high] = this.rows.within("hard", this.time(x - 1), this.time(x + 1));
    const value = low <= high ? [`hard to ${high.toFixed(3)} pF`] : [];
    this.hover.show(x, [clock(t - this.rows.extent.begin, 1), ...value, ...this.tale.said(t, near)]);
  }

  draw() {
    if (!this.sheet.begin()) return;
    this.renew();
    const { sheet } = this, { width, height } = sheet;
    sheet.context.drawImage(this.strip, 0, 0, width, height);
    const a = Math.max(0, this.x(this.looking.from)), b = Math.max(a + 4, Math.min(width, this.x(this.looking.to)));
    sheet.fill("ground", 0, 0, a, height, 0.6);
    sheet.fill("ground", b, 0, width - b, height, 0.6);
    for (const { text, x, y, colour } of this.labels) sheet.text(text, x, y, { colour, bold: colour === "bad" });
    sheet.context.strokeStyle = sheet.colour("ink");
    sheet.context.lineWidth = 2;
    sheet.context.strokeRect(a + 1, 1, b - a - 2, height - 2);
    if (this.selected) sheet.fill("band", this.selected[0], 0, this.selected[1] - this.selected[0], height);
  }

  // Draws the strip again if it has changed, not too often.
  renew() {
    const all = this.rows.views.all, of = `${this.rows.extent.end} ${all?.to} ${all?.rows}`, wait = this.drawn.at + EVERY_MS - performance.now();
    if (of === this.drawn.of) return;
    clearTimeout(this.later);
    if (wait > 0) this.later = setTimeout(this.redraw, wait);
    else {
      this.drawn = { at: performance.now(), of };
      this.drawStrip();
    }
  }

  drawStrip() {
    const { sheet, rows } = this, { width, height } = sheet, { begin, end, held } = rows.extent;
    this.since = begin;
    this.until = Math.max(end, begin + 1);
    this.ask(begin, end, held, width);
    const top = 14 * sheet.unit, foot = height - 2;
    this.blocks(top, foot);
    this.area(top, foot);
    this.signs(top, foot);
    this.label(top);
    sheet.name = `The whole ${this.looking.file ? "recording" : "measurement"}: ${clock(end - begin)}, ${this.tale.counted()}`;
    Object.assign(this.strip, { width: sheet.canvas.width, height: sheet.canvas.height });
    this.strip.getContext("2d").drawImage(sheet.canvas, 0, 0);
    sheet.begin();
  }

  ask(begin, end, held, width) {
    const { all } = this.rows.views;
    const stale = !all || all.to < held - STALE * (end - begin) || all.rows < width;
    if (held > begin && stale && !this.rows.views.underWay().some(({ purpose }) => purpose === "all")) this.rows.views.ask("all", begin, end, 2 * width);
  }

  area(top, foot) {
    const { sheet } = this, pieces = this.rows.pieces(this.since, this.until);
    const range = [0, 0.2];
    for (const { block, rows } of pieces) extremes(block, ["hard"], rows, range);
    const y = (value) => foot - (Math.max(0, value) / (1.08 * range[1])) * (foot - top - 2);
    sheet.context.fillStyle = sheet.colour("past");
    this.points = pieces.reduce((sum, { block, rows }) => sum + this.fillUnder(block, rows, y, foot), 0);
  }

  // Below the highest value of each pixel; a gap stays empty. Returns the number of bars.
  fillUnder({ t, hard }, [first, end], y, foot) {
    const most = Math.max(1, this.x(this.since + GAP_S));
    let bars = 0, column = NaN, high = 0;
    for (let k = first; k <= end; k++) {
      if (k < end && hard[k] !== hard[k]) continue; // NaN
      const here = k < end ? Math.floor(this.x(t[k])) : Infinity;
      if (here !== column) {
        if (high > 0) this.sheet.context.fillRect(column, y(high), Math.min(here - column, most), foot - y(high));
        bars += high > 0;
        column = here;
        high = 0;
      }
      if (hard[k] > high) high = hard[k];
    }
    return bars;
  }

  blocks(top, foot) {
    for (const { start_s, end_s, kept } of this.tale.all) {
      const x = this.x(start_s), width = Math.max(1, this.x(end_s) - x);
      this.sheet.fill(kept ? "fband" : "caution", x, top, width, foot - top, kept ? 1 : 0.55);
    }
  }

  signs(top, foot) {
    const { sheet, tale } = this;
    for (const { from_s, to_s } of tale.gaps) sheet.hatch(this.x(from_s), top, Math.max(2, this.x(to_s) - this.x(from_s)), foot - top);
    for (const t of tale.tares) sheet.text("▴", this.x(t), foot - 5, { colour: "ink", align: "center" });
    for (const { t_s } of tale.marks) sheet.line("ink", this.x(t_s), top, this.x(t_s), foot, { dash: [2, 3] });
  }

  // Numbers of the touches above them, M at a mark, where they have room: left out ones first.
  label(top) {
    const { sheet, tale } = this, height = 12 * sheet.unit, edges = { left: 0, right: sheet.width, top: 0, bottom: sheet.height };
    const wanted = (text, t, y, colour) => {
      const width = sheet.measure(text, colour === "bad"), x = this.x(t) - width / 2;
      return { text, width, height, colour, places: [[Math.max(0, Math.min(sheet.width - width, x)), y]] };
    };
    const touches = tale.all.toSorted((a, b) => Number(a.kept) - Number(b.kept));
    const numbers = touches.map(({ number, start_s, end_s, kept }) => wanted(String(number), (start_s + end_s) / 2, top / 2, kept ? "ink" : "bad"));
    this.labels = placed([...numbers, ...tale.marks.map(({ t_s }) => wanted("M", t_s, top + height / 2, "ink"))], edges);
  }
}
