// The charts of time: the whole measurement as one strip with the window on it, and the window itself.

import { clock, number } from "../formatting.js";
import { decades, placed, placesOf, shortened, stepOf, ticks, timeStep } from "./axes.js";
import { bars, extremes, trace } from "./plot.js";
import { Hover } from "./readout.js";
import { Sheet, inside } from "./sheet.js";

const STILL = 4; // pixels that a click may move
const WHEEL = 0.0022; // zoom for each pixel of the wheel
const HANDLE = 8; // pixels: an edge of the window, or a cursor, is dragged from there
const STALE = 0.02; // share of the measurement that may be missing in the view of everything
const LEAST_PF = 0.02; // height of the chart while it follows: the noise alone looks quiet
const STACKED = 4; // labels one below the other

// A chart of time that is dragged, zoomed and read by pointer, wheel and fingers. A chart says what a drag does from an x:
// grab(x) -> (x, dx) => {}, or null: a part is selected; what a click does; what is at the pointer: tell(x or null); and what
// it shows: axis { from, to (s), left, right (pixels) }.
class TimeChart {
  // charts: Charts
  constructor(place, charts) {
    Object.assign(this, { place, charts, rows: charts.rows, looking: charts.window, tale: charts.tale, cursors: charts.cursors });
    this.sheet = new Sheet(place, () => charts.redraw("time"));
    this.hover = new Hover(place);
    this.selected = null; // [x, x] while a part is selected
    this.held = new Map(); // pointers that are down -> x
    this.pointed = null; // x of the pointer that only points
    place.addEventListener("pointerdown", (event) => this.down(event));
    place.addEventListener("pointermove", (event) => this.move(event));
    for (const name of ["pointerup", "pointercancel"]) place.addEventListener(name, (event) => this.up(event));
    place.addEventListener("pointerleave", () => this.point(null));
    place.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
  }

  x(t) {
    const { from, to, left, right } = this.axis;
    return left + ((t - from) / (to - from)) * (right - left);
  }

  seconds(pixels) {
    const { from, to, left, right } = this.axis;
    return (pixels / (right - left)) * (to - from);
  }

  time(x) {
    const { from, left, right } = this.axis;
    return from + this.seconds(Math.max(left, Math.min(right, x)) - left);
  }

  down(event) {
    if (event.button) return;
    const [x] = inside(this.place, event);
    this.place.setPointerCapture(event.pointerId);
    this.held.set(event.pointerId, x);
    this.start = this.held.size > 1 ? null : { x, last: x, moved: false, drag: event.shiftKey ? null : this.grab(x) };
  }

  move(event) {
    const [x] = inside(this.place, event), before = this.pinch();
    if (!this.held.has(event.pointerId)) return this.point(x);
    this.held.set(event.pointerId, x);
    if (before) {
      const { middle, apart } = this.pinch();
      this.looking.zoom(before.apart / apart, this.time(middle));
      this.looking.pan(this.seconds(before.middle - middle));
    } else if (this.start) this.drag(x);
  }

  // The pointer is at x, or gone: the page says anew what is there when the chart is drawn.
  point(x) {
    this.pointed = x;
    this.tell(x);
  }

  // Two fingers; null: there are not two.
  pinch() {
    const [a, b] = this.held.values();
    return this.held.size === 2 ? { middle: (a + b) / 2, apart: Math.max(20, Math.abs(a - b)) } : null;
  }

  drag(x) {
    const { start } = this;
    start.moved ||= Math.abs(x - start.x) > STILL;
    if (!start.moved) return;
    if (start.drag) start.drag(x, x - start.last);
    else this.selected = [Math.min(start.x, x), Math.max(start.x, x)];
    start.last = x;
    this.point(null);
    this.charts.redraw("time");
  }

  up(event) {
    const { start, selected } = this, known = this.held.delete(event.pointerId), [x, y] = inside(this.place, event);
    if (this.held.size) return;
    this.start = null;
    if (!known || !start) return;
    this.selected = null;
    this.charts.redraw("time");
    if (event.type !== "pointerup") return;
    if (!start.moved) this.click(x, y, event);
    else if (selected) (this.file ? this.charts.find : (...span) => this.looking.show(...span))(...selected.map((edge) => this.time(edge)));
  }

  wheel(event) {
    event.preventDefault();
    const scale = event.deltaMode ? 16 : 1, [x] = inside(this.place, event);
    if (Math.abs(event.deltaX) > Math.abs(event.deltaY)) this.looking.pan(this.seconds(event.deltaX * scale));
    else this.looking.zoom(Math.exp(Math.max(-240, Math.min(240, event.deltaY * scale)) * WHEEL), this.time(x));
  }

  draw() {
    if (!this.sheet.begin()) return;
    this.paint();
    if (this.selected) this.sheet.fill("band", this.selected[0], this.top, this.selected[1] - this.selected[0], this.foot - this.top);
    if (this.pointed !== null) this.tell(this.pointed); // after a zoom something else is there
  }

  // A label whose middle is at a moment, as far as the sheet has room.
  centred(text, t, y, height, colour) {
    const { sheet } = this, width = sheet.measure(text, colour === "bad"), x = Math.max(0, Math.min(sheet.width - width, this.x(t) - width / 2));
    return { text, width, height, colour, places: [[x, y]] };
  }

  // Of touches that lie together in a few pixels one; those that were left out come first.
  sparse(touches) {
    const found = new Map();
    for (const touch of touches) {
      const at = Math.floor(this.x(touch.start_s) / (6 * this.sheet.unit));
      if (!found.has(at) || (found.get(at).kept && !touch.kept)) found.set(at, touch);
    }
    return [...found.values()].toSorted((a, b) => a.kept - b.kept);
  }

  // Touches and gaps as areas, `strength` of those that were left out.
  shade(touches, top, foot, strength) {
    const { sheet } = this;
    for (const { start_s, end_s, kept } of touches) {
      const x = this.x(start_s), width = Math.max(1, this.x(end_s) - x);
      sheet.fill(kept ? "fband" : "caution", x, top, width, foot - top, kept ? 1 : strength);
    }
    for (const { from_s, to_s } of this.tale.events.gaps) {
      const a = Math.max(0, this.x(from_s)), b = Math.min(sheet.width, this.x(to_s));
      if (b >= a) sheet.hatch(a, top, Math.max(2, b - a), foot - top);
    }
  }
}

// The whole measurement as one strip: touches, marks, gaps, tares, and the window, which can be dragged. Of a file: the ratio
// of each touch as a dot.
export class Overview extends TimeChart {
  // Inside the window: it is dragged; at its edges: they are; elsewhere, and in a file: a part is selected.
  grab(x) {
    if (this.file) return null;
    const { from, to } = this.looking, [a, b] = [this.x(from), this.x(to)];
    if (Math.abs(x - a) < HANDLE && b - a > 3 * HANDLE) return (to_x) => this.looking.show(Math.min(this.time(to_x), to - 0.01), to);
    if (Math.abs(x - b) < HANDLE && b - a > 3 * HANDLE) return (to_x) => this.looking.show(from, Math.max(this.time(to_x), from + 0.01));
    if (x < a - HANDLE || x > b + HANDLE || b - a > 0.98 * this.sheet.width) return null;
    return (_, dx) => this.looking.pan(this.seconds(dx));
  }

  // The window goes to where it is clicked, and the touch there is shown; of a file: the touch whose dot is the nearest.
  click(x, y) {
    if (this.file && this.shown.length) {
      const away = (dot) => Math.hypot(dot.x - x, dot.y - y);
      return this.charts.choose(this.shown.reduce((best, dot) => (away(dot) < away(best) ? dot : best)).number);
    }
    const t = this.time(x), { from, to } = this.looking, touch = this.tale.touchAt(t, this.time(x + 4) - t);
    const half = Math.min(to - from, Math.max(30, 0.1 * (to - from))) / 2;
    if (touch) this.charts.choose(touch.number);
    this.looking.show(t - half, t + half);
  }

  tell(x) {
    if (x === null || !this.axis) return this.hover.hide();
    const t = this.time(x), near = this.time(x + 4) - t;
    const [low, high] = this.rows.within("hard", this.time(x - 1), this.time(x + 1));
    const value = low <= high ? [`hard to ${high.toFixed(3)} pF`] : [];
    this.hover.show(x, [clock(t - this.rows.extent.begin, 1), ...value, ...this.tale.said(t, near)]);
  }

  paint() {
    const { sheet } = this, { begin, end, held } = this.rows.extent, file = (this.file = Boolean(this.tale.known.found)), k = sheet.unit, top = 14 * k, foot = sheet.height - (file ? 26 * k : 2);
    Object.assign(this, { top: 0, foot: file ? foot : sheet.height });
    this.axis = { from: begin, to: Math.max(end, begin + 1), left: file ? 34 * k : 0, right: sheet.width - (file ? 6 * k : 0) };
    this.ask(begin, end, held, sheet.width);
    this.shade(file ? [] : this.tale.all, top, foot, 0.55);
    if (file) this.dots(4 * k, foot);
    else this.area(top, foot);
    this.signs(top, foot);
    if (!file) this.drawWindow(sheet);
    sheet.name = `The whole ${this.looking.file ? "recording" : "measurement"}: ${clock(end - begin)}, ${this.tale.counted()}`;
  }

  // Dots on a logarithmic axis: those that are found, the others behind them, flags below, and the chosen one.
  dots(top, foot) {
    const { sheet, tale, axis } = this, k = sheet.unit, r = tale.all.length > 500 ? k : 2 * k, found = new Set(tale.known.found), logs = tale.all.filter(({ ratio }) => ratio > 0).map(({ ratio }) => Math.log10(ratio));
    const [low, high] = [Math.min(...logs) - 0.04, Math.max(...logs) + 0.04], y = (ratio) => foot - ((Math.log10(ratio) - low) / (high - low)) * (foot - top), [a, b] = [10 ** low, 10 ** high];
    for (const ratio of !logs.length ? [] : high - low > 0.5 ? decades(low, high, [1, 2, 5]) : ticks(a, b, stepOf(b - a, 4))) {
      sheet.line("grid", axis.left, y(ratio), axis.right, y(ratio));
      sheet.text(String(Number(ratio.toPrecision(6))), axis.left - 6, y(ratio), { align: "right" });
    }
    for (const t of ticks(0, axis.to - axis.from, timeStep(axis.to - axis.from, (axis.right - axis.left) / (84 * k)))) sheet.text(clock(t), this.x(t + axis.from), sheet.height - 7 * k, { align: "center" });
    this.points = logs.length;
    this.shown = tale.all.filter(({ ratio }) => ratio > 0).map((one) => ({ number: one.number, x: this.x(one.start_s), y: y(one.ratio), colour: found.has(one) ? "ratio" : "past" }));
    for (const colour of ["past", "ratio"]) for (const dot of this.shown) if (dot.colour === colour) sheet.fill(colour, dot.x - r, dot.y - r, 2 * r, 2 * r);
    for (const one of tale.all) if (one.flags.length || !one.kept) sheet.text("▴", this.x(one.start_s), foot + 5 * k, { colour: "bad", align: "center" });
    sheet.fill("fband", this.x(this.looking.from), top, Math.max(1, this.x(this.looking.to) - this.x(this.looking.from)), foot - top, 0.5);
    const here = this.shown.find(({ number: n }) => n === tale.known.chosen);
    if (!here) return;
    sheet.line("ink", here.x, 0, here.x, foot, { width: 2 });
    sheet.fill("ink", here.x - 4 * k, here.y - 4 * k, 8 * k, 8 * k);
  }

  // The window, and the labels above what it veils.
  drawWindow({ context, width, height }) {
    const { sheet } = this, a = Math.max(0, this.x(this.looking.from)), b = Math.max(a + 4, Math.min(width, this.x(this.looking.to)));
    sheet.fill("ground", 0, 0, a, height, 0.6);
    sheet.fill("ground", b, 0, width - b, height, 0.6);
    this.label(14 * sheet.unit);
    context.strokeStyle = sheet.colour("ink");
    context.lineWidth = 2;
    context.strokeRect(a + 1, 1, b - a - 2, height - 2);
  }

  ask(begin, end, held, width) {
    const { all } = this.rows;
    const stale = !all || all.to < held - STALE * (end - begin) || all.rows < width;
    if (held > begin && stale && !this.rows.expects("all")) this.rows.ask("all", begin, end, 2 * width);
  }

  area(top, foot) {
    const pieces = this.rows.pieces(this.axis.from, this.axis.to), range = [0, 0.2];
    for (const { block, rows } of pieces) extremes(block, ["hard"], rows, range);
    const x = (t) => this.x(t), y = (value) => foot - (Math.max(0, value) / (1.08 * range[1])) * (foot - top - 2);
    this.points = pieces.reduce((sum, { block, rows }) => sum + bars(this.sheet, "past", block, block.hard, rows, x, y, true), 0);
  }

  signs(top, foot) {
    const { sheet } = this, { tares, marks } = this.tale.events;
    for (const t of tares) sheet.text("▴", this.x(t), foot - 5, { colour: "ink", align: "center" });
    for (const { t_s } of marks) sheet.line("ink", this.x(t_s), top, this.x(t_s), foot, { dash: [2, 3] });
  }

  // Numbers of the touches above them, M at a mark, where they have room: left out ones first.
  label(top) {
    const { sheet, tale } = this, height = 12 * sheet.unit, edges = { left: 0, right: sheet.width, top: 0, bottom: sheet.height };
    const numbers = this.sparse(tale.all).map(({ number, start_s, end_s, kept }) => this.centred(String(number), (start_s + end_s) / 2, top / 2, height, kept ? "ink" : "bad"));
    this.labels = placed([...numbers, ...tale.events.marks.map(({ t_s }) => this.centred("M", t_s, top + height / 2, height, "ink"))], edges);
    for (const { text, x, y, colour } of this.labels) sheet.text(text, x, y, { colour, bold: colour === "bad" });
  }
}

// The window: the capacitance changes, with touches, marks, gaps, tares and two cursors.
export class Detail extends TimeChart {
  pointer = null; // time at the pointer

  get axis() {
    const { looking: { from, to }, left, right } = this;
    return { from, to, left, right };
  }

  grab(x) {
    const which = this.cursors.times.findIndex((t) => t !== null && Math.abs(this.x(t) - x) < HANDLE);
    if (which >= 0) return (to) => this.cursors.put(which, this.time(to));
    return (_, dx) => this.looking.pan(-this.seconds(dx));
  }

  // In the line of the touches' labels: shows that touch. Below: puts cursor A, with shift or the second finger tap B.
  click(x, y, event) {
    const t = this.time(x), touch = y < this.top ? this.tale.touchAt(t) : null, [a, b] = this.cursors.times;
    if (touch) return this.charts.choose(touch.number);
    const second = event.shiftKey || (event.pointerType === "touch" && a !== null && b === null);
    this.cursors.put(second ? 1 : 0, t);
  }

  tell(x) {
    this.pointer = x === null || x < this.left ? null : this.time(x);
    if (this.pointer === null) return this.hover.hide();
    const t = this.pointer, half = this.seconds(0.5), row = this.rows.at(t);
    if (!row) return this.hover.hide();
    const places = Math.min(4, placesOf(this.seconds(1)) + 1), values = ["hard", "soft"].map((name) => `${name} ${this.range(name, t, half, row)} pF`);
    const ratio = Number.isNaN(row.ratio) ? [] : [`ratio ${number(row.ratio, row.error)}`];
    this.hover.show(x, [clock(t - this.rows.extent.begin, places), ...values, ...ratio, ...this.tale.said(t, this.seconds(4))]);
  }

  // A value; of many rows in one pixel the lowest and highest.
  range(name, t, half, row) {
    const [low, high] = this.rows.within(name, t - half, t + half);
    return low < high ? `${low.toFixed(4)} to ${high.toFixed(4)}` : Number.isNaN(row[name]) ? "–" : row[name].toFixed(4);
  }

  paint() {
    const { sheet } = this, { unit } = sheet, { from, to } = this.looking;
    Object.assign(this, { left: 46 * unit, right: sheet.width - 4 * unit, top: 17 * unit, foot: sheet.height - 18 * unit });
    this.rows.need(from, to);
    const pieces = this.rows.pieces(from, to);
    const scale = (this.right - this.left) / (to - from), x = (t) => this.left + (t - from) * scale;
    this.points = 0;
    this.scale(pieces);
    this.axes(from, to);
    sheet.clipped(this.left, this.top, this.right - this.left, this.foot - this.top, () => {
      this.shade(this.touches(from, to), this.top, this.foot, 0.45);
      for (const name of ["soft", "hard"]) for (const { block, rows } of pieces) this.points += trace(sheet, name, block, rows, x, this.y);
    });
    this.labels = [...this.touchLabels(from, to), ...this.signs(from, to)];
    for (const label of this.labels) sheet.text(label.text, label.x, label.y, { colour: label.colour, bold: label.colour === "bad", back: !("touch" in label) });
    this.drawCursors();
    this.nameIt(from, to, pieces);
  }

  // Steps, so that the scale does not creep.
  scale(pieces) {
    const range = [0, this.looking.fixed ? 1e-6 : LEAST_PF], { unit } = this.sheet;
    for (const { block, rows } of pieces) extremes(block, ["hard", "soft"], rows, range);
    const step = stepOf(range[1] - range[0], Math.max(2, (this.foot - this.top) / (22 * unit)));
    const high = Math.ceil((1.04 * range[1]) / (step / 2)) * (step / 2), noise = range[0] > -0.1 * high;
    const low = noise ? 0 : Math.floor(range[0] / step) * step;
    const bottom = noise ? Math.min(0, 1.2 * range[0]) : low;
    const y = (value) => this.foot - ((value - bottom) / (high - bottom)) * (this.foot - this.top - 2);
    Object.assign(this, { y, values: ticks(low, high, step), step });
  }

  axes(from, to) {
    const { sheet, left, right, top, foot } = this, places = placesOf(this.step), small = this.step < 1e-4;
    for (const value of this.values) {
      sheet.line(Math.abs(value) < this.step / 2 ? "past" : "grid", left, this.y(value), right, this.y(value));
      sheet.text(small ? value.toExponential(0) : value.toFixed(places).replace("-", "−"), left - 6, this.y(value), { align: "right" });
    }
    const { begin } = this.rows.extent, step = timeStep(to - from, (right - left) / (84 * sheet.unit)), digits = placesOf(step);
    for (const t of ticks(from - begin, to - begin, step)) {
      const x = this.x(t + begin), text = clock(t, digits), half = sheet.measure(text) / 2;
      sheet.line("grid", x, top, x, foot);
      sheet.text(text, Math.min(x, sheet.width - half), foot + 10 * sheet.unit, { align: "center" });
    }
  }

  touches(from, to) {
    return this.tale.all.filter(({ start_s, end_s }) => end_s >= from && start_s <= to);
  }

  // Number and ratio above each touch, or the numbers alone if that is too much.
  touchLabels(from, to) {
    const { sheet } = this, height = 13 * sheet.unit, edges = { left: 0, right: sheet.width, top: 0, bottom: this.top }, touches = this.touches(from, to);
    const label = (one, ratio) => {
      const text = `${one.kept ? "" : "▲ "}${one.number}${ratio ? ` · ${one.running ? "…" : number(one.ratio, one.uncertainty)}` : ""}`;
      const middle = (Math.max(from, one.start_s) + Math.min(to, one.end_s)) / 2;
      return { ...this.centred(text, middle, this.top / 2, height, one.kept ? "ink" : "bad"), touch: one.number };
    };
    const some = this.sparse(touches), whole = placed(some.map((one) => label(one, true)), edges);
    return whole.length === touches.length ? whole : placed(some.map((one) => label(one, false)), edges);
  }

  // Lines of marks, tares, judgements and flags, each with its label beside it, stacked where they meet.
  signs(from, to) {
    const { sheet, top, foot } = this, { events } = this.tale, height = 14 * sheet.unit, edges = { left: this.left, right: this.right, top, bottom: foot };
    const flags = [...events.judgements, ...events.flags].map(({ t_s, text, name }) => ({ t: t_s, text: `▲ ${text || name}`, colour: "bad" }));
    const marks = events.marks.map(({ t_s, text }) => ({ t: t_s, text: text || "mark", colour: "ink" }));
    const tares = events.tares.map((t) => ({ t, text: "tare", colour: "ink", low: true }));
    const gaps = events.gaps.map(({ from_s, to_s, lost }) => ({ t: Math.max(from_s, Math.min(from, to_s)), text: `gap, ${lost} lost`, colour: "ink", bare: true }));
    const wanted = [...flags, ...marks, ...tares, ...gaps].filter(({ t }) => t >= from && t <= to).map((one) => {
      const x = this.x(one.t), room = this.right - this.left - 10;
      const text = shortened(one.text, room, (part) => sheet.measure(part, true)), width = sheet.measure(text, true);
      if (!one.bare) sheet.line(one.colour, x, top, x, foot, { dash: [2, 3] });
      const rows = Array.from({ length: Math.max(1, Math.min(STACKED, Math.floor((foot - top) / height))) }, (_, k) => (one.low ? foot - (k + 0.5) * height : top + (k + 0.5) * height));
      return { ...one, text, width, height, at: x, places: rows.flatMap((row) => [[x + 5, row], [x - 5 - width, row]]) };
    });
    return placed(wanted, edges);
  }

  drawCursors() {
    const { sheet, top, foot } = this, size = 16 * sheet.unit;
    this.cursors.times.forEach((t, i) => {
      if (t === null || t < this.looking.from || t > this.looking.to) return;
      const x = this.x(t);
      sheet.line("ink", x, top - 2, x, foot, { width: 1.5 });
      sheet.fill("ink", x - size / 2, foot - size - 1, size, size);
      sheet.text("AB"[i], x, foot - size / 2, { colour: "card", bold: true, align: "center" });
    });
  }

  nameIt(from, to, pieces) {
    const { begin } = this.rows.extent, [low, high] = pieces.reduce((range, { block, rows }) => extremes(block, ["hard"], rows, range), [Infinity, -Infinity]);
    const found = this.touches(from, to).map(({ number: n }) => n), most = low <= high ? `, hard ${low.toFixed(3)} to ${high.toFixed(3)} pF` : "";
    const touches = found.length ? `, touches ${found.length > 6 ? `${found[0]} to ${found.at(-1)}` : found.join(", ")}` : "";
    this.sheet.name = `Capacitance changes from ${clock(from - begin)} to ${clock(to - begin)}${most}${touches}`;
  }
}
