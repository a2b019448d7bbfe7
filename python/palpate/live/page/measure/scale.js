// The scale from soft to stiff: this touch as a bar as wide as its interval, earlier touches as dots, known specimens as ticks.

import { escaped, measure } from "../charts/svg.js";
import { $ } from "../dom.js";
import { settings } from "../formatting.js";
import { COVERING, isUnsure, showsModulus, subject } from "../reading.js";
import { objectName } from "./object.js";

const RATIOS = { from: 1, to: 10, most: 40 };
const MODULI_MPA = { from: 0.1, to: 10, least: 0.001, most: 1000 };
const STEPS = [1, 2, 5, 10]; // the ends of a scale of moduli, and its numbers
const EARLIER = 40; // dots
const NAME_ROWS = 2;
const FEW_NAMES = 3; // with fewer the scale has numbers, too
const LONGEST = 16; // letters of a name on the scale
const LOWEST = 52; // px: without room there is no scale
const MARGIN = 24; // at each end: for the arrows
const TOP = 44; // y of the scale
const NUMBERS = 84; // y of its numbers
const ROW = 23;
const APART = 4; // between two names

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
  const { hello, touches, session } = known;
  const byModulus = showsModulus(known);
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

// The scale as SVG text, in units in which its text has 20.
export function scaleOf(content, width, height) {
  const unit = Math.max(0.6, Math.min(height / 150, width / 600, 2.4));
  const right = width / unit - MARGIN;
  const x = (value) => MARGIN + Math.max(0, Math.min(1, shareOf(content, value))) * (right - MARGIN);
  const inside = ({ at }) => at >= content.from && at <= content.to;
  const parts = [
    `<rect class="track" x="${MARGIN}" y="${TOP - 6}" width="${right - MARGIN}" height="12" rx="6"/>`,
    ends(content, right),
    numbers(content, x),
    names(content.ticks.filter(inside), x, right + MARGIN),
    ...content.dots.filter(inside).map(({ at, here }) => circle(`dot ${here ? "here" : ""}`, x(at), TOP - 21, 5.6)),
    barOf(content, x),
  ];
  const name = escaped(inWords(content));
  return `<svg width="${width}" height="${height}" viewBox="0 0 ${width / unit} ${height / unit}" role="img" aria-label="${name}">${parts.join("")}</svg>`;
}

function shareOf({ from, to, log }, value) {
  return log ? Math.log(value / from) / Math.log(to / from) : (value - from) / (to - from);
}

function ends({ log, from, to }, right) {
  const [soft, stiff] = log ? ["soft", "stiff"] : [`${from} very soft`, `${to} rigid`];
  return text(MARGIN, 15, soft, "", "start") + text(right, 15, stiff, "", "end");
}

function barOf({ bar, kind, from, to }, x) {
  if (!bar) return "";
  const look = kind ? "past" : "";
  const stiffer = arrow(x(to), 1, look);
  const softer = arrow(x(from), -1, look);
  if (bar.low > to) return stiffer;
  if (bar.high < from) return softer;
  const begin = x(bar.low);
  const wide = Math.max(x(bar.high) - begin, 6);
  let drawn = `<rect class="bar ${look}" x="${begin}" y="${TOP - 15}" width="${wide}" height="30" rx="6"/>`;
  if (bar.high > to) drawn += stiffer;
  if (bar.low < from) drawn += softer;
  if (bar.at >= from && bar.at <= to) drawn += circle(`this ${look}`, x(bar.at), TOP, 11);
  return drawn;
}

// Beyond the scale: an arrow at its end.
function arrow(x, sign, look) {
  return `<path class="arrow ${look}" d="M${x + 22 * sign} ${TOP}L${x} ${TOP - 16}v32Z"/>`;
}

function circle(look, x, y, radius) {
  return `<circle class="${look}" cx="${x}" cy="${y}" r="${radius}"/>`;
}

// With few names, decades or whole ratios.
function numbers({ from, to, log, ticks }, x) {
  if (ticks.length >= FEW_NAMES) return "";
  const factor = log && settings.unit === "kPa" ? 1000 : 1;
  let drawn = "";
  for (let value = log ? decade(from) : from + 1; value < to; value = log ? 10 * value : value + 1) {
    if (value >= from) drawn += mark(x(value)) + text(x(value), NUMBERS, Number((factor * value).toPrecision(3)));
  }
  return drawn;
}

function mark(x) {
  return `<path class="tick" d="M${x} ${TOP + 7}v18"/>`;
}

// A tick for each known specimen; its name where there is room: the present one first, the others from soft to stiff.
function names(ticks, x, width) {
  const order = ticks.toSorted((a, b) => b.here - a.here || a.at - b.at);
  const first = NUMBERS + (ticks.length < FEW_NAMES ? ROW : 0);
  const taken = [];
  let drawn = "";
  for (const { at, name, here } of order) {
    const shown = name.length > LONGEST ? `${name.slice(0, LONGEST - 1)}…` : name;
    const half = measure(shown, 20 / 12) / 2;
    const middle = Math.max(half, Math.min(width - half, x(at)));
    const row = freeRow(taken, middle - half - APART, middle + half + APART);
    drawn += mark(x(at));
    if (row === null) continue;
    taken.push({ row, from: middle - half, to: middle + half });
    drawn += text(middle, first + ROW * row, shown, here ? "here" : "");
  }
  return drawn;
}

function freeRow(taken, from, to) {
  for (let row = 0; row < NAME_ROWS; row += 1) {
    const crossed = taken.some((one) => one.row === row && from < one.to && to > one.from);
    if (!crossed) return row;
  }
  return null;
}

function text(x, y, shown, look = "", anchor = "middle") {
  return `<text class="${look}" x="${x}" y="${y}" font-size="20" text-anchor="${anchor}">${escaped(shown)}</text>`;
}

function inWords({ bar, from, to, ticks }) {
  const scale = `Scale from soft, ${from}, to stiff, ${to}`;
  const known = ticks.length ? `, with ${ticks.length} known specimens` : "";
  if (!bar) return `${scale}${known}.`;
  const place = bar.low > to ? "stiffer than all of it" : bar.high < from ? "softer than all of it" : "inside";
  return `${scale}${known}: this touch is ${place}.`;
}
