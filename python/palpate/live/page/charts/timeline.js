// The charts of time: the whole measurement as one strip with the window on it, and the window itself.

import { clock, number } from "../formatting.js";
import { decades, placed, placesOf, shortened, stepOf, ticks, timeStep } from "./axes.js";
import { bars, extremes, trace } from "./plot.js";
import { Hover } from "./readout.js";
import { Canvas, inside } from "./canvas.js";

const STILL = 4; // pixels that a click may move
const WHEEL = 0.0022; // zoom for each pixel of the wheel
const HANDLE = 8; // pixels: an edge of the window, or a cursor, is dragged from there
const STALE = 0.02; // share of the measurement that may be missing in the view of everything
const LEAST_PF = 0.02; // height of the chart while it follows: the noise alone looks quiet
const STACKED = 4; // labels one below the other

// A chart of time that is dragged, zoomed and read by pointer, wheel and fingers. A chart says what a drag does from an x:
// grab(x) -> (x, dx) => {}, or null: a part is selected; what a click does; what is at the pointer: showValues(x or null); and what
// it shows: axis { from, to (s), left, right (pixels) }.
class TimeChart {
  // charts: Charts
  constructor(place, charts) {
    Object.assign(this, {
      place,
      charts,
      rows: charts.rows,
      viewport: charts.viewport,
      annotations: charts.annotations,
      cursors: charts.cursors,
    });
    this.canvas = new Canvas(place, () => charts.redraw("time"));
    this.hover = new Hover(place);
    this.selected = null; // [x, x] while a part is selected
    this.held = new Map(); // pointers that are down -> x
    this.pointed = null; // x of the pointer that only points
    place.addEventListener("pointerdown", (event) => this.down(event));
    place.addEventListener("pointermove", (event) => this.move(event));
    for (const name of ["pointerup", "pointercancel"])
      place.addEventListener(name, (event) => this.up(event));
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
    this.start = null;
    if (this.held.size > 1) return;
    this.start = { x, last: x, moved: false, drag: event.shiftKey ? null : this.grab(x) };
  }

  move(event) {
    const [x] = inside(this.place, event);
    const before = this.pinch();
    if (!this.held.has(event.pointerId)) {
      this.point(x);
      return;
    }
    this.held.set(event.pointerId, x);
    if (before) {
      const { middle, apart } = this.pinch();
      this.viewport.zoom(before.apart / apart, this.time(middle));
      this.viewport.pan(this.seconds(before.middle - middle));
    } else if (this.start) {
      this.drag(x);
    }
  }

  // The pointer is at x, or gone; what is there is shown again when the chart is drawn.
  point(x) {
    this.pointed = x;
    this.showValues(x);
  }

  // Two fingers; null: there are not two.
  pinch() {
    if (this.held.size !== 2) return null;
    const [a, b] = this.held.values();
    return { middle: (a + b) / 2, apart: Math.max(20, Math.abs(a - b)) };
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
    const { start, selected } = this;
    const known = this.held.delete(event.pointerId);
    const [x, y] = inside(this.place, event);
    if (this.held.size) return;
    this.start = null;
    if (!known || !start) return;
    this.selected = null;
    this.charts.redraw("time");
    if (event.type !== "pointerup") return;
    if (!start.moved) this.click(x, y, event);
    else if (selected) this.select(...selected.map((edge) => this.time(edge)));
  }

  // A part was selected: the window goes there; in the strip of a file the touches there are found.
  select(from, to) {
    if (this.file) this.charts.find(from, to);
    else this.viewport.show(from, to);
  }

  wheel(event) {
    event.preventDefault();
    const scale = event.deltaMode ? 16 : 1;
    const [x] = inside(this.place, event);
    if (Math.abs(event.deltaX) > Math.abs(event.deltaY)) {
      this.viewport.pan(this.seconds(event.deltaX * scale));
      return;
    }
    const turned = Math.max(-240, Math.min(240, event.deltaY * scale));
    this.viewport.zoom(Math.exp(turned * WHEEL), this.time(x));
  }

  draw() {
    if (!this.canvas.begin()) return;
    this.paint();
    if (this.selected) {
      const [from, to] = this.selected;
      this.canvas.fill("band", from, this.top, to - from, this.foot - this.top);
    }
    if (this.pointed !== null) this.showValues(this.pointed); // after a zoom something else is there
  }

  // A label whose middle is at a moment, as far as the canvas has room.
  centred(text, t, y, height, colour) {
    const { canvas } = this;
    const width = canvas.measure(text, colour === "bad");
    const x = Math.max(0, Math.min(canvas.width - width, this.x(t) - width / 2));
    return { text, width, height, colour, places: [[x, y]] };
  }

  // Of touches that lie together in a few pixels one; those that were left out come first.
  sparse(touches) {
    const found = new Map();
    for (const touch of touches) {
      const at = Math.floor(this.x(touch.start_s) / (6 * this.canvas.unit));
      if (!found.has(at) || (found.get(at).kept && !touch.kept)) found.set(at, touch);
    }
    return [...found.values()].toSorted((a, b) => a.kept - b.kept);
  }

  // Touches and gaps as areas, `strength` of those that were left out.
  shade(touches, top, foot, strength) {
    const { canvas } = this;
    for (const { start_s, end_s, kept } of touches) {
      const x = this.x(start_s);
      const width = Math.max(1, this.x(end_s) - x);
      canvas.fill(kept ? "fband" : "caution", x, top, width, foot - top, kept ? 1 : strength);
    }
    for (const { from_s, to_s } of this.annotations.events.gaps) {
      const a = Math.max(0, this.x(from_s));
      const b = Math.min(canvas.width, this.x(to_s));
      if (b >= a) canvas.hatch(a, top, Math.max(2, b - a), foot - top);
    }
  }
}

// The whole measurement as one strip: touches, marks, gaps, tares, and the window, which can be dragged. Of a file: the ratio
// of each touch as a dot.
export class Overview extends TimeChart {
  // Inside the window: it is dragged; at its edges: they are; elsewhere, and in a file: a part is selected.
  grab(x) {
    if (this.file) return null;
    const { from, to } = this.viewport;
    const [a, b] = [this.x(from), this.x(to)];
    if (Math.abs(x - a) < HANDLE && b - a > 3 * HANDLE)
      return (to_x) => this.viewport.show(Math.min(this.time(to_x), to - 0.01), to);
    if (Math.abs(x - b) < HANDLE && b - a > 3 * HANDLE)
      return (to_x) => this.viewport.show(from, Math.max(this.time(to_x), from + 0.01));
    if (x < a - HANDLE || x > b + HANDLE || b - a > 0.98 * this.canvas.width) return null;
    return (_, dx) => this.viewport.pan(this.seconds(dx));
  }

  // The window goes to where it is clicked, and the touch there is shown; of a file: the touch whose dot is the nearest.
  click(x, y) {
    if (this.file && this.shown.length) {
      const away = (dot) => Math.hypot(dot.x - x, dot.y - y);
      const nearest = this.shown.reduce((best, dot) => (away(dot) < away(best) ? dot : best));
      this.charts.choose(nearest.number);
      return;
    }
    const t = this.time(x);
    const { from, to } = this.viewport;
    const touch = this.annotations.touchAt(t, this.time(x + 4) - t);
    const half = Math.min(to - from, Math.max(30, 0.1 * (to - from))) / 2;
    if (touch) this.charts.choose(touch.number);
    this.viewport.show(t - half, t + half);
  }

  showValues(x) {
    if (x === null || !this.axis) return this.hover.hide();
    const t = this.time(x);
    const near = this.time(x + 4) - t;
    const [low, high] = this.rows.within("hard", this.time(x - 1), this.time(x + 1));
    const value = low <= high ? [`hard to ${high.toFixed(3)} pF`] : [];
    this.hover.show(x, [
      clock(t - this.rows.extent.begin, 1),
      ...value,
      ...this.annotations.messagesAt(t, near),
    ]);
  }

  paint() {
    const { canvas } = this;
    const { begin, end, held } = this.rows.extent;
    const file = Boolean(this.annotations.known.found);
    this.file = file;
    const k = canvas.unit;
    const top = 14 * k;
    const foot = canvas.height - (file ? 26 * k : 2);
    Object.assign(this, { top: 0, foot: file ? foot : canvas.height });
    this.axis = {
      from: begin,
      to: Math.max(end, begin + 1),
      left: file ? 34 * k : 0,
      right: canvas.width - (file ? 6 * k : 0),
    };
    this.requestAll(begin, end, held, canvas.width);
    this.shade(file ? [] : this.annotations.all, top, foot, 0.55);
    if (file) this.dots(4 * k, foot);
    else this.area(top, foot);
    this.signs(top, foot);
    if (!file) this.drawWindow(canvas);
    canvas.name = `The whole ${this.viewport.file ? "recording" : "measurement"}: ${clock(end - begin)}, ${this.annotations.counted()}`;
  }

  // Dots on a logarithmic axis: those that are found, the others behind them, flags below, and the chosen one.
  dots(top, foot) {
    const { canvas, annotations, axis } = this;
    const k = canvas.unit;
    const r = annotations.all.length > 500 ? k : 2 * k;
    const found = new Set(annotations.known.found);
    const logs = annotations.all
      .filter(({ ratio }) => ratio > 0)
      .map(({ ratio }) => Math.log10(ratio));
    const [low, high] = [Math.min(...logs) - 0.04, Math.max(...logs) + 0.04];
    const y = (ratio) => foot - ((Math.log10(ratio) - low) / (high - low)) * (foot - top);
    const [a, b] = [10 ** low, 10 ** high];
    const step = stepOf(b - a, 4);
    const values = high - low > 0.5 ? decades(low, high, [1, 2, 5]) : ticks(a, b, step);
    for (const ratio of logs.length ? values : []) {
      canvas.line("grid", axis.left, y(ratio), axis.right, y(ratio));
      canvas.text(String(Number(ratio.toPrecision(6))), axis.left - 6, y(ratio), {
        align: "right",
      });
    }
    const span = axis.to - axis.from;
    const every = timeStep(span, (axis.right - axis.left) / (84 * k));
    for (const t of ticks(0, span, every)) {
      canvas.text(clock(t), this.x(t + axis.from), canvas.height - 7 * k, { align: "center" });
    }
    this.points = logs.length;
    const drawn = annotations.all.filter(({ ratio }) => ratio > 0);
    this.shown = drawn.map((one) => {
      const colour = found.has(one) ? "ratio" : "past";
      return { number: one.number, x: this.x(one.start_s), y: y(one.ratio), colour };
    });
    for (const colour of ["past", "ratio"]) {
      for (const dot of this.shown) {
        if (dot.colour === colour) canvas.fill(colour, dot.x - r, dot.y - r, 2 * r, 2 * r);
      }
    }
    for (const one of annotations.all) {
      if (one.kept && !one.flags.length) continue;
      canvas.text("▴", this.x(one.start_s), foot + 5 * k, { colour: "bad", align: "center" });
    }
    const [from, to] = [this.x(this.viewport.from), this.x(this.viewport.to)];
    canvas.fill("fband", from, top, Math.max(1, to - from), foot - top, 0.5);
    const here = this.shown.find(({ number: n }) => n === annotations.known.chosen);
    if (!here) return;
    canvas.line("ink", here.x, 0, here.x, foot, { width: 2 });
    canvas.fill("ink", here.x - 4 * k, here.y - 4 * k, 8 * k, 8 * k);
  }

  // The window, and the labels above what it veils; no label lies on its frame.
  drawWindow({ context, width, height }) {
    const { canvas } = this;
    const a = Math.max(0, this.x(this.viewport.from));
    const b = Math.max(a + 4, Math.min(width, this.x(this.viewport.to)));
    canvas.fill("ground", 0, 0, a, height, 0.6);
    canvas.fill("ground", b, 0, width - b, height, 0.6);
    context.strokeStyle = canvas.colour("ink");
    context.lineWidth = 2;
    context.strokeRect(a + 1, 1, b - a - 2, height - 2);
    this.label(14 * canvas.unit, [a, b]);
  }

  requestAll(begin, end, held, width) {
    const { all } = this.rows;
    const stale = !all || all.to < held - STALE * (end - begin) || all.rows < width;
    if (held <= begin || !stale || this.rows.expects("all")) return;
    this.rows.request("all", begin, end, 2 * width);
  }

  area(top, foot) {
    const pieces = this.rows.pieces(this.axis.from, this.axis.to);
    const range = [0, 0.2];
    for (const { block, rows } of pieces) extremes(block, ["hard"], rows, range);
    const x = (t) => this.x(t);
    const y = (value) => foot - (Math.max(0, value) / (1.08 * range[1])) * (foot - top - 2);
    this.points = 0;
    for (const { block, rows } of pieces) {
      this.points += bars(this.canvas, "past", block, block.hard, rows, x, y, true);
    }
  }

  signs(top, foot) {
    const { canvas } = this;
    const { tares, marks } = this.annotations.events;
    for (const t of tares)
      canvas.text("▴", this.x(t), foot - 5, { colour: "ink", align: "center" });
    for (const { t_s } of marks) {
      canvas.line("ink", this.x(t_s), top, this.x(t_s), foot, { dash: [2, 3] });
    }
  }

  // Numbers of the touches above them, M at a mark, where they have room beside the frame of the window: left out ones first.
  label(top, frame) {
    const { canvas, annotations } = this;
    const height = 12 * canvas.unit;
    const edges = { left: 0, right: canvas.width, top: 0, bottom: canvas.height };
    const numbers = this.sparse(annotations.all).map(({ number, start_s, end_s, kept }) => {
      const middle = (start_s + end_s) / 2;
      return this.centred(String(number), middle, top / 2, height, kept ? "ink" : "bad");
    });
    const marks = annotations.events.marks.map(({ t_s }) =>
      this.centred("M", t_s, top + height / 2, height, "ink"),
    );
    const free = [...numbers, ...marks].map((one) => {
      const places = one.places.flatMap(([x, y]) => besideFrame(x, one.width, frame, y));
      return { ...one, places };
    });
    this.labels = placed(free, edges);
    for (const { text, x, y, colour } of this.labels) {
      canvas.text(text, x, y, { colour, bold: colour === "bad" });
    }
  }
}

const CLEAR = 4; // px between a label and the frame of the window

// Places of a label that would be at x: there, or else on either side of the edge of a frame that crosses it.
function besideFrame(x, width, frame, y) {
  const edge = frame.find((one) => one > x - CLEAR && one < x + width + CLEAR);
  if (edge === undefined) return [[x, y]];
  return [
    [edge + CLEAR, y],
    [edge - CLEAR - width, y],
  ];
}

// The window: the capacitance changes, with touches, marks, gaps, tares and two cursors.
export class Detail extends TimeChart {
  pointer = null; // time at the pointer

  get axis() {
    const { from, to } = this.viewport;
    return { from, to, left: this.left, right: this.right };
  }

  grab(x) {
    const near = (t) => t !== null && Math.abs(this.x(t) - x) < HANDLE;
    const which = this.cursors.times.findIndex(near);
    if (which >= 0) return (to) => this.cursors.put(which, this.time(to));
    return (_, dx) => this.viewport.pan(-this.seconds(dx));
  }

  // In the line of the touches' labels: shows that touch. Below: puts cursor A, with shift or the second finger tap B.
  click(x, y, event) {
    const t = this.time(x);
    const touch = y < this.top ? this.annotations.touchAt(t) : null;
    const [a, b] = this.cursors.times;
    if (touch) return this.charts.choose(touch.number);
    const second = event.shiftKey || (event.pointerType === "touch" && a !== null && b === null);
    this.cursors.put(second ? 1 : 0, t);
  }

  showValues(x) {
    this.pointer = x === null || x < this.left ? null : this.time(x);
    if (this.pointer === null) return this.hover.hide();
    const t = this.pointer;
    const half = this.seconds(0.5);
    const row = this.rows.at(t);
    if (!row) return this.hover.hide();
    const places = Math.min(4, placesOf(this.seconds(1)) + 1);
    const values = ["hard", "soft"].map((name) => `${name} ${this.range(name, t, half, row)} pF`);
    const ratio = Number.isNaN(row.ratio) ? [] : [`ratio ${number(row.ratio, row.error)}`];
    this.hover.show(x, [
      clock(t - this.rows.extent.begin, places),
      ...values,
      ...ratio,
      ...this.annotations.messagesAt(t, this.seconds(4)),
    ]);
  }

  // A value; of many rows in one pixel the lowest and highest.
  range(name, t, half, row) {
    const [low, high] = this.rows.within(name, t - half, t + half);
    if (low < high) return `${low.toFixed(4)} to ${high.toFixed(4)}`;
    return Number.isNaN(row[name]) ? "–" : row[name].toFixed(4);
  }

  paint() {
    const { canvas } = this;
    const { unit } = canvas;
    const { from, to } = this.viewport;
    Object.assign(this, {
      left: 46 * unit,
      right: canvas.width - 4 * unit,
      top: 17 * unit,
      foot: canvas.height - 18 * unit,
    });
    this.rows.need(from, to);
    const pieces = this.rows.pieces(from, to);
    const scale = (this.right - this.left) / (to - from);
    const x = (t) => this.left + (t - from) * scale;
    this.points = 0;
    this.scale(pieces);
    this.axes(from, to);
    canvas.clipped(this.left, this.top, this.right - this.left, this.foot - this.top, () => {
      this.shade(this.touches(from, to), this.top, this.foot, 0.45);
      for (const name of ["soft", "hard"]) {
        for (const { block, rows } of pieces) {
          this.points += trace(canvas, name, block, rows, x, this.y);
        }
      }
    });
    this.labels = [...this.touchLabels(from, to), ...this.signs(from, to)];
    for (const { text, x: at, y, colour, touch } of this.labels) {
      canvas.text(text, at, y, { colour, bold: colour === "bad", back: touch === undefined });
    }
    this.drawCursors();
    this.nameIt(from, to, pieces);
  }

  // Steps, so that the scale does not creep.
  scale(pieces) {
    const range = [0, this.viewport.fixed ? 1e-6 : LEAST_PF];
    const { unit } = this.canvas;
    for (const { block, rows } of pieces) extremes(block, ["hard", "soft"], rows, range);
    const step = stepOf(range[1] - range[0], Math.max(2, (this.foot - this.top) / (22 * unit)));
    const high = Math.ceil((1.04 * range[1]) / (step / 2)) * (step / 2);
    const noise = range[0] > -0.1 * high;
    const low = noise ? 0 : Math.floor(range[0] / step) * step;
    const bottom = noise ? Math.min(0, 1.2 * range[0]) : low;
    const y = (value) =>
      this.foot - ((value - bottom) / (high - bottom)) * (this.foot - this.top - 2);
    Object.assign(this, { y, values: ticks(low, high, step), step });
  }

  axes(from, to) {
    const { canvas, left, right, top, foot } = this;
    const places = placesOf(this.step);
    const small = this.step < 1e-4;
    for (const value of this.values) {
      const y = this.y(value);
      const text = small ? value.toExponential(0) : value.toFixed(places).replace("-", "−");
      canvas.line(Math.abs(value) < this.step / 2 ? "past" : "grid", left, y, right, y);
      canvas.text(text, left - 6, y, { align: "right" });
    }
    const { begin } = this.rows.extent;
    const step = timeStep(to - from, (right - left) / (84 * canvas.unit));
    const digits = placesOf(step);
    for (const t of ticks(from - begin, to - begin, step)) {
      const x = this.x(t + begin);
      const text = clock(t, digits);
      const half = canvas.measure(text) / 2;
      canvas.line("grid", x, top, x, foot);
      const at = Math.min(x, canvas.width - half);
      canvas.text(text, at, foot + 10 * canvas.unit, { align: "center" });
    }
  }

  touches(from, to) {
    return this.annotations.all.filter(({ start_s, end_s }) => end_s >= from && start_s <= to);
  }

  // Number and ratio above each touch, or the numbers alone if that is too much.
  touchLabels(from, to) {
    const { canvas } = this;
    const height = 13 * canvas.unit;
    const edges = { left: 0, right: canvas.width, top: 0, bottom: this.top };
    const touches = this.touches(from, to);
    const label = (one, value) => {
      const text = `${one.kept ? "" : "▲ "}${one.number}${value(one)}`;
      const middle = (Math.max(from, one.start_s) + Math.min(to, one.end_s)) / 2;
      const where = this.centred(text, middle, this.top / 2, height, one.kept ? "ink" : "bad");
      return { ...where, touch: one.number };
    };
    const ratio = (one) => ` · ${one.running ? "…" : number(one.ratio, one.uncertainty)}`;
    const some = this.sparse(touches);
    const whole = placed(
      some.map((one) => label(one, ratio)),
      edges,
    );
    if (whole.length === touches.length) return whole;
    return placed(
      some.map((one) => label(one, () => "")),
      edges,
    );
  }

  // Lines of marks, tares, judgements and flags, each with its label beside it, stacked where they meet.
  signs(from, to) {
    const { canvas, top, foot } = this;
    const { events } = this.annotations;
    const height = 14 * canvas.unit;
    const edges = { left: this.left, right: this.right, top, bottom: foot };
    const { flags, judgements, marks, tares, gaps } = events;
    const signs = [
      ...[...judgements, ...flags].map(({ t_s, name }) => {
        return { t: t_s, text: `▲ ${name}`, colour: "bad" };
      }),
      ...marks.map(({ t_s, text }) => ({ t: t_s, text: text || "mark", colour: "ink" })),
      ...tares.map((t) => ({ t, text: "tare", colour: "ink", low: true })),
      ...gaps.map(({ from_s, to_s, lost }) => {
        const t = Math.max(from_s, Math.min(from, to_s));
        return { t, text: `gap, ${lost} lost`, colour: "ink", bare: true };
      }),
    ];
    const stacked = Math.max(1, Math.min(STACKED, Math.floor((foot - top) / height)));
    const wanted = signs
      .filter(({ t }) => t >= from && t <= to)
      .map((one) => {
        const x = this.x(one.t);
        const room = this.right - this.left - 10;
        const text = shortened(one.text, room, (part) => canvas.measure(part, true));
        const width = canvas.measure(text, true);
        if (!one.bare) canvas.line(one.colour, x, top, x, foot, { dash: [2, 3] });
        const places = [];
        for (let row = 0; row < stacked; row++) {
          const down = (row + 0.5) * height;
          const y = one.low ? foot - down : top + down;
          places.push([x + 5, y], [x - 5 - width, y]);
        }
        return { ...one, text, width, height, at: x, places };
      });
    return placed(wanted, edges);
  }

  drawCursors() {
    const { canvas, top, foot } = this;
    const size = 16 * canvas.unit;
    this.cursors.times.forEach((t, i) => {
      if (t === null || t < this.viewport.from || t > this.viewport.to) return;
      const x = this.x(t);
      canvas.line("ink", x, top - 2, x, foot, { width: 1.5 });
      canvas.fill("ink", x - size / 2, foot - size - 1, size, size);
      canvas.text("AB"[i], x, foot - size / 2, { colour: "card", bold: true, align: "center" });
    });
  }

  nameIt(from, to, pieces) {
    const { begin } = this.rows.extent;
    const range = [Infinity, -Infinity];
    for (const { block, rows } of pieces) extremes(block, ["hard"], rows, range);
    const [low, high] = range;
    const found = this.touches(from, to).map(({ number: n }) => n);
    const parts = [`Capacitance changes from ${clock(from - begin)} to ${clock(to - begin)}`];
    if (low <= high) parts.push(`hard ${low.toFixed(3)} to ${high.toFixed(3)} pF`);
    if (found.length > 6) parts.push(`touches ${found[0]} to ${found.at(-1)}`);
    else if (found.length) parts.push(`touches ${found.join(", ")}`);
    this.canvas.name = parts.join(", ");
  }
}
