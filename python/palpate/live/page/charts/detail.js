// The window: the capacitance changes, with touches, marks, gaps, tares and two cursors.

import { Hover } from "./hover.js";
import { number } from "../formatting.js";
import { placed, shortened } from "./labels.js";
import { extremes, trace } from "./plot.js";
import { gestures } from "./pointers.js";
import { Sheet } from "./sheet.js";
import { clock, placesOf, stepOf, ticks, timeStep } from "./ticks.js";

const GRIP = 8; // pixels: a cursor is dragged from there
const LEAST_PF = 0.02; // height of the chart while it follows: the noise alone looks quiet
const STACKED = 4; // labels one below the other
const STILL_MS = 120; // then the window stands still, and is drawn exactly

export class Detail {
  // rows: Rows, looking: Looking, tale: Tale, cursors: Cursors, choose(number of a touch), redraw()
  constructor(place, { rows, looking, tale, cursors, choose, redraw }) {
    Object.assign(this, { rows, looking, tale, cursors, choose, redraw });
    this.sheet = new Sheet(place, () => this.dress());
    this.hover = new Hover(place);
    this.pointer = null; // time at the pointer
    this.selected = null;
    this.window = [];
    this.labels = [];
    gestures(place, {
      grab: (x) => this.grab(x),
      selecting: (a, b) => this.select(a, b),
      select: (a, b) => looking.show(this.time(a), this.time(b)),
      click: (x, y, event) => this.click(x, y, event),
      hover: (x) => this.tell(x),
      zoom: (factor, x) => looking.zoom(factor, this.time(x)),
      slide: (pixels) => looking.pan(this.seconds(pixels)),
    });
  }

  dress() {
    this.sheet.dress();
    this.redraw();
  }

  x(t) {
    return this.left + ((t - this.looking.from) / (this.looking.to - this.looking.from)) * (this.right - this.left);
  }

  seconds(pixels) {
    return (pixels / (this.right - this.left)) * (this.looking.to - this.looking.from);
  }

  time(x) {
    return this.looking.from + this.seconds(Math.max(this.left, Math.min(this.right, x)) - this.left);
  }

  grab(x) {
    const which = this.cursors.times.findIndex((t) => t !== null && Math.abs(this.x(t) - x) < GRIP);
    if (which >= 0) return (to) => this.cursors.put(which, this.time(to));
    return (_, dx) => this.looking.pan(-this.seconds(dx));
  }

  select(a, b) {
    this.selected = a === null ? null : [Math.min(a, b), Math.max(a, b)];
    this.redraw();
  }

  // In the line of the touches' labels: shows that touch. Below: puts cursor A, with shift or the second finger tap B.
  click(x, y, event) {
    const t = this.time(x), touch = y < this.top ? this.tale.touchAt(t) : null, [a, b] = this.cursors.times;
    if (touch) return this.choose(touch.number);
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

  draw() {
    if (!this.sheet.begin()) return;
    const { sheet } = this, { unit } = sheet, { from, to } = this.looking;
    Object.assign(this, { left: 46 * unit, right: sheet.width - 4 * unit, top: 17 * unit, foot: sheet.height - 18 * unit });
    this.ask(from, to);
    const pieces = this.rows.pieces(from, to), y = this.scale(pieces);
    this.axes(from, to);
    this.clipped(() => {
      this.shade();
      this.lines(pieces, y);
    });
    this.labels = [...this.touchLabels(from, to), ...this.signs(from, to)];
    for (const label of this.labels) sheet.text(label.text, label.x, label.y, { colour: label.colour, bold: label.colour === "bad", back: !("touch" in label) });
    this.drawCursors();
    if (this.selected) sheet.fill("band", this.selected[0], this.top, this.selected[1] - this.selected[0], this.foot - this.top);
    this.nameIt(from, to, pieces);
  }

  // A window that moves is drawn from wider views; one that stands still is asked for exactly.
  ask(from, to) {
    const { extent } = this.rows, now = performance.now(), moved = this.window[0] !== from || this.window[1] !== to;
    if (moved) this.movedAt = now;
    this.window = [from, to];
    if (from >= extent.held) return;
    const still = now - this.movedAt >= STILL_MS;
    this.rows.views.need(from, to, this.right - this.left, still, extent);
    clearTimeout(this.settling);
    if (!still) this.settling = setTimeout(this.redraw, STILL_MS);
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
    return y;
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

  clipped(draw) {
    const { context } = this.sheet;
    context.save();
    context.beginPath();
    context.rect(this.left, this.top, this.right - this.left, this.foot - this.top);
    context.clip();
    draw();
    context.restore();
  }

  shade() {
    const { sheet, top, foot } = this, { from, to } = this.looking;
    for (const { start_s, end_s, kept } of this.touches(from, to)) {
      sheet.fill(kept ? "fband" : "caution", this.x(start_s), top, Math.max(1, this.x(end_s) - this.x(start_s)), foot - top, kept ? 1 : 0.45);
    }
    for (const { from_s, to_s } of this.tale.gaps) {
      if (to_s >= from && from_s <= to) sheet.hatch(this.x(from_s), top, Math.max(2, this.x(to_s) - this.x(from_s)), foot - top);
    }
  }

  touches(from, to) {
    return this.tale.all.filter(({ start_s, end_s }) => end_s >= from && start_s <= to);
  }

  lines(pieces, y) {
    const { from, to } = this.looking, { left, right } = this, scale = (right - left) / (to - from), x = (t) => left + (t - from) * scale;
    this.points = 0;
    for (const name of ["soft", "hard"]) {
      for (const { block, rows } of pieces) this.points += trace(this.sheet, name, block, name, rows, x, y);
    }
  }

  // Number and ratio above each touch, or the numbers alone if that is too much.
  touchLabels(from, to) {
    const { sheet } = this, height = 13 * sheet.unit, edges = { left: 0, right: sheet.width, top: 0, bottom: this.top }, touches = this.touches(from, to);
    const labels = (ratios) => {
      const wanted = touches.map((one) => {
        const text = `${one.kept ? "" : "▲ "}${one.number}${ratios ? ` · ${one.running ? "…" : number(one.ratio, one.uncertainty)}` : ""}`;
        const width = sheet.measure(text, true), middle = (this.x(Math.max(from, one.start_s)) + this.x(Math.min(to, one.end_s))) / 2;
        const x = Math.max(0, Math.min(sheet.width - width, middle - width / 2));
        return { text, width, height, colour: one.kept ? "ink" : "bad", touch: one.number, places: [[x, this.top / 2]] };
      });
      return placed(wanted.toSorted((a, b) => Number(b.colour === "bad") - Number(a.colour === "bad")), edges);
    };
    const whole = labels(true);
    return whole.length === touches.length ? whole : labels(false);
  }

  // Lines of marks, tares and flags, each with its label beside it, stacked where they meet.
  signs(from, to) {
    const { sheet, tale, top, foot } = this, height = 14 * sheet.unit, edges = { left: this.left, right: this.right, top, bottom: foot };
    const flags = tale.events.flags.map(({ t_s, text, name }) => ({ t: t_s, text: `▲ ${text || name}`, colour: "bad" }));
    const marks = tale.marks.map(({ t_s, text }) => ({ t: t_s, text: text || "mark", colour: "ink" }));
    const tares = tale.tares.map((t) => ({ t, text: "tare", colour: "ink", low: true }));
    const gaps = tale.gaps.map(({ from_s, to_s, lost }) => ({ t: Math.max(from_s, Math.min(from, to_s)), text: `gap, ${lost} lost`, colour: "ink", bare: true }));
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
