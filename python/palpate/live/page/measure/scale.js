// The scale from soft to stiff: this touch as a bar as wide as its interval, earlier touches as dots, known specimens as ticks.

import { escaped, measure } from "../charts/svg.js";
import { $ } from "../dom.js";
import { settings } from "../formatting.js";
import { COVERING, isUnsure, subject } from "../reading.js";
import { objectName } from "./object.js";

const RATIOS = { from: 1, to: 10, most: 40 };
const MODULI_MPA = { from: 0.1, to: 10, least: 0.001, most: 1000 };
const STEPS = [1, 2, 5, 10]; // the ends of a scale of moduli, and its numbers
const EARLIER = 40; // dots
const NAME_ROWS = 2;
const FEW_NAMES = 3; // with fewer the scale has numbers, too
const LONGEST = 16; // letters of a name on the scale
const LOWEST = 52; // px: without room there is no scale
const EDGE = 0.04; // of the width, at each end: for the arrows

export class Scale {
  constructor() {
    this.place = $("scale");
    new ResizeObserver(() => this.draw()).observe(this.place);
  }

  update(type, known) {
    this.known = known;
    if (document.body.dataset.depth === "measure") this.draw();
  }

  draw() {
    const { clientWidth: width, clientHeight: height } = this.place;
    if (!this.known || !width) return;
    const shown = JSON.stringify([width, height, contentOf(this.known)]);
    if (shown === this.shown) return;
    this.shown = shown;
    this.place.innerHTML = height < LOWEST ? "" : scaleOf(contentOf(this.known), width, height);
  }
}

// What the scale shows, as plain values: { log, from, to, unit, bar, dots, ticks }.
export function contentOf(known) {
  const { hello, touches, session, calibration } = known;
  const byModulus = hello.calibrated && !calibration.on;
  const valueOf = byModulus ? modulusValues : ratioValues;
  const one = subject(known);
  const name = objectName(known);
  const bar = one && !isUnsure(one, hello) ? valueOf(one) : null;
  const earlier = touches.rows.filter((row) => row.kept !== false && row.number !== one?.number);
  const dots = earlier.slice(-EARLIER).map((row) => ({ at: valueOf(row)?.at, here: row.specimen === name }));
  const ticks = session.specimens
    .map((each) => ({ at: byModulus ? each.modulus : each.mean, name: each.name, here: each.name === name }))
    .filter(({ at }) => at !== null && at > 0);
  const values = [...dots, ...ticks].map(({ at }) => at).filter((at) => at > 0);
  const range = byModulus ? moduliRange(values) : ratioRange(values);
  return { ...range, log: byModulus, bar, kind: one?.kind, dots: dots.filter(({ at }) => at > 0), ticks };
}

function modulusValues({ modulus }) {
  if (!modulus) return null;
  const { value_MPa: at, low_MPa: low, high_MPa: high } = modulus;
  if (low === null && at === null) return null;
  const end = high ?? Infinity;
  return { at: at ?? (end === Infinity ? end : low), low, high: end };
}

function ratioValues({ ratio, uncertainty }) {
  if (ratio === null) return null;
  const half = COVERING * (uncertainty ?? 0);
  return { at: ratio, low: ratio - half, high: ratio + half };
}

// The scale stands still: its ends are round numbers around what is known, never around a touch that goes on.
function moduliRange(values) {
  const { from, to, least, most } = MODULI_MPA;
  const low = values.length ? Math.max(least, Math.min(...values) / 1.3) : from;
  const high = values.length ? Math.min(most, Math.max(...values) * 1.3) : to;
  const range = { from: roundDown(low), to: roundUp(high) };
  if (range.to < 10 * range.from) return { from: roundDown(low / 3), to: roundUp(high * 3) };
  return range;
}

function ratioRange(values) {
  const { from, to, most } = RATIOS;
  const high = Math.ceil(Math.max(to, ...values.filter((value) => value < most)));
  return { from: values.some((value) => value < from) ? 0 : from, to: high };
}

function decade(value) {
  return 10 ** Math.floor(Math.log10(value) + 1e-9);
}

function roundDown(value) {
  return STEPS.findLast((step) => step * decade(value) <= value * 1.0001) * decade(value);
}

function roundUp(value) {
  return STEPS.find((step) => step * decade(value) >= value * 0.9999) * decade(value);
}

// The scale as SVG text.
export function scaleOf(content, width, height) {
  const unit = Math.min(height / 150, width / 600, 2.4);
  const size = Math.max(12, 20 * unit);
  const left = Math.max(14, EDGE * width);
  const right = width - left;
  const share = ({ from, to, log }, value) => (log ? Math.log(value / from) / Math.log(to / from) : (value - from) / (to - from));
  const x = (value) => left + Math.max(0, Math.min(1, share(content, value))) * (right - left);
  const top = 2.2 * size;
  const parts = [
    track(left, right, top, size),
    ends(content, left, right, size),
    numbers(content, x, top, size),
    names(content, x, top, size, width),
    dotsOf(content, x, top, size),
    barOf(content, x, top, size),
  ];
  return `<svg width="${width}" height="${height}" viewBox="0 0 ${width} ${height}" role="img" aria-label="${escaped(inWords(content))}">${parts.join("")}</svg>`;
}

function track(left, right, top, size) {
  const high = 0.6 * size;
  return `<rect class="track" x="${left}" y="${top - high / 2}" width="${right - left}" height="${high}" rx="${high / 2}"/>`;
}

function ends({ log, from, to }, left, right, size) {
  const [soft, stiff] = log ? ["soft", "stiff"] : [`${from} very soft`, `${to} rigid`];
  return text(left, 0.85 * size, soft, size, "start") + text(right, 0.85 * size, stiff, size, "end");
}

function barOf({ bar, kind, from, to }, x, top, size) {
  if (!bar) return "";
  const high = 1.5 * size;
  const look = kind ? "past" : "";
  if (bar.low > to) return arrow(x(to), top, size, 1, look);
  if (bar.high < from) return arrow(x(from), top, size, -1, look);
  const [begin, end] = [x(bar.low), x(bar.high)];
  const wide = Math.max(end - begin, 0.3 * size);
  let drawn = `<rect class="bar ${look}" x="${begin}" y="${top - high / 2}" width="${wide}" height="${high}" rx="${0.3 * size}"/>`;
  if (bar.high > to) drawn += arrow(x(to), top, size, 1, look);
  if (bar.low < from) drawn += arrow(x(from), top, size, -1, look);
  if (bar.at >= from && bar.at <= to) drawn += `<circle class="this ${look}" cx="${x(bar.at)}" cy="${top}" r="${0.55 * size}"/>`;
  return drawn;
}

// Beyond the scale: an arrow at its end.
function arrow(x, y, size, sign, look) {
  const tip = x + sign * 1.1 * size;
  return `<path class="arrow ${look}" d="M${tip} ${y}L${x} ${y - 0.8 * size}V${y + 0.8 * size}Z"/>`;
}

function dotsOf({ dots, from, to }, x, top, size) {
  const inside = dots.filter(({ at }) => at >= from && at <= to);
  return inside.map(({ at, here }) => `<circle class="dot ${here ? "here" : ""}" cx="${x(at)}" cy="${top - 1.05 * size}" r="${0.28 * size}"/>`).join("");
}

function numbers(content, x, top, size) {
  const { from, to, log, ticks } = content;
  if (ticks.length >= FEW_NAMES) return "";
  const values = log ? moduliNumbers(from, to) : ratioNumbers(from, to);
  const factor = log && settings.unit === "kPa" ? 1000 : 1;
  const y = top + 2 * size;
  return values.map((value) => mark(x(value), top, 0.9 * size) + text(x(value), y, Number((factor * value).toPrecision(3)), size, "middle")).join("");
}

function moduliNumbers(from, to) {
  const values = [];
  for (let value = decade(from); value <= to * 1.0001; value *= 10) {
    if (value >= from * 0.9999) values.push(value);
  }
  return values;
}

function ratioNumbers(from, to) {
  const values = [];
  for (let value = from + 1; value < to; value += 1) values.push(value);
  return values;
}

function mark(x, top, length) {
  return `<path class="tick" d="M${x} ${top + 0.4 * length}v${length}"/>`;
}

// A tick for each known specimen; its name where there is room: the present one first, the others from soft to stiff.
function names({ ticks, from, to }, x, top, size, width) {
  const inside = ticks.filter(({ at }) => at >= from && at <= to);
  const order = inside.toSorted((a, b) => b.here - a.here || a.at - b.at);
  const first = top + (ticks.length < FEW_NAMES ? 3.2 : 2) * size;
  const taken = [];
  let drawn = "";
  for (const { at, name, here } of order) {
    const shown = name.length > LONGEST ? `${name.slice(0, LONGEST - 1)}…` : name;
    const half = measure(shown, size / 12) / 2;
    const middle = Math.max(half, Math.min(width - half, x(at)));
    const row = freeRow(taken, middle - half, middle + half, size);
    drawn += mark(x(at), top, 0.9 * size);
    if (row === null) continue;
    taken.push({ row, from: middle - half, to: middle + half });
    drawn += text(middle, first + 1.15 * size * row, shown, size, "middle", here ? "here" : "");
  }
  return drawn;
}

function freeRow(taken, from, to, size) {
  for (let row = 0; row < NAME_ROWS; row += 1) {
    const crossed = taken.some((one) => one.row === row && from < one.to + 0.2 * size && to > one.from - 0.2 * size);
    if (!crossed) return row;
  }
  return null;
}

function text(x, y, shown, size, anchor, look = "") {
  return `<text class="${look}" x="${x}" y="${y}" font-size="${size}" text-anchor="${anchor}">${escaped(shown)}</text>`;
}

function inWords({ bar, from, to, ticks }) {
  const scale = `Scale from soft, ${from}, to stiff, ${to}`;
  const known = ticks.length ? `, with ${ticks.length} known specimens` : "";
  if (!bar) return `${scale}${known}.`;
  const place = bar.low > to ? "stiffer than all of it" : bar.high < from ? "softer than all of it" : "inside";
  return `${scale}${known}: this touch is ${place}.`;
}
