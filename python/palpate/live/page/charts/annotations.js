// What happened in the measurement: touches, marks, tares, gaps, judgements, flags, as the server sends them, and the rows of
// touches.

import { MEASURED, indexOf } from "../store.js";
import { joins } from "./plot.js";

const KEPT = 24; // touches

export class Annotations {
  // known: the newest message of each kind
  constructor(known) {
    this.known = known;
    this.clear();
  }

  clear() {
    this.running = null; // the touch that goes on
    this.blocks = new Map(); // touch -> the rows of it and around it; the newest used last
  }

  get touches() {
    return this.known.touches.rows;
  }

  // { marks, tares, gaps, judgements, flags }
  get events() {
    return this.known.events;
  }

  get all() {
    return this.running ? [...this.touches, this.running] : this.touches;
  }

  // The touch at a moment, or one that is not further away than `near`.
  touchAt(t, near = 0) {
    const within = (slack) => (one) => one.start_s - slack <= t && t <= one.end_s + slack;
    return this.all.find(within(0)) ?? this.all.find(within(near)) ?? null;
  }

  // The touch that is nearest to a moment; null: there is none.
  nearestTo(t) {
    const away = ({ start_s, end_s }) => Math.max(start_s - t, t - end_s, 0);
    return this.all.reduce((best, one) => (best && away(best) <= away(one) ? best : one), null);
  }

  // Keeps the rows of a touch.
  keep(number, block) {
    this.blocks.delete(number);
    this.blocks.set(number, block);
    if (this.blocks.size > KEPT) this.blocks.delete(this.blocks.keys().next().value);
  }

  // Sentences for what is at a moment, or `near` it.
  messagesAt(t, near) {
    const touch = this.touchAt(t, near);
    const close = (at) => Math.abs(at - t) <= near;
    const { marks, tares, gaps, judgements, flags } = this.events;
    const found = [];
    if (touch) {
      const out = touch.kept ? null : `left out: ${touch.why}`;
      found.push([`touch ${touch.number}`, touch.specimen, out].filter(Boolean).join(", "));
    }
    for (const { from_s, to_s, lost, text } of gaps) {
      if (from_s - near <= t && t <= to_s + near) found.push(text || `gap, ${lost} lost`);
    }
    for (const { t_s, text } of marks) if (close(t_s)) found.push(text || "mark");
    if (tares.some(close)) found.push("tare");
    for (const { t_s, text } of [...judgements, ...flags]) if (close(t_s)) found.push(text);
    return found.filter(Boolean);
  }

  // What Explain points at: flags and other advice of a touch; judgements, gaps and marks around it. Each sentence once, in the
  // order of time: [{ t_s, text, bad }].
  pinsOf(touch, from, to) {
    const { flags, judgements, gaps, marks } = this.events;
    const own = flags.filter((flag) => flag.touch === touch.number);
    const advised = (touch.advice ?? []).map((text) => ({ t_s: touch.end_s, text }));
    const lost = gaps.map(({ from_s, lost: n, text }) => {
      return { t_s: from_s, text: text || `gap: ${n} pairs are lost` };
    });
    const marked = marks.map(({ t_s, text }) => ({ t_s, text: text || "mark", bad: false }));
    const around = [...judgements, ...lost, ...marked].filter(
      ({ t_s }) => t_s >= from && t_s <= to,
    );
    const found = new Map();
    for (const { t_s, text, name, bad = true } of [...own, ...advised, ...around]) {
      const sentence = text || name;
      if (!found.has(sentence)) found.set(sentence, { t_s, text: sentence, bad });
    }
    return [...found.values()].toSorted((a, b) => a.t_s - b.t_s);
  }

  counted() {
    const { marks, tares, gaps } = this.events;
    const out = this.touches.filter(({ kept }) => !kept).length;
    const many = (n, one, more = `${one}s`) => `${n} ${n === 1 ? one : more}`;
    const touches =
      many(this.touches.length, "touch", "touches") + (out ? ` (${out} left out)` : "");
    return [
      touches,
      many(marks.length, "mark"),
      many(gaps.length, "gap"),
      many(tares.length, "tare"),
    ].join(", ");
  }
}

const POINTS = 400;
const SAMPLES = 400; // bins of a curve that has more samples
const SLACK_S = 1e-6; // the times of rows and of touches are rounded
const ENDING_S = 0.5; // a touch that has just ended stays until its result arrives

// A touch that goes on: since its first row after the last completed touch. null: none.
export function runningOf(store, last) {
  const { block } = store;
  const now = block.t[store.used - 1];
  const after = last?.end_s ?? -Infinity;
  const measured = (k) => block.flags[k] & MEASURED;
  let used = store.used;
  while (used > block.first && !measured(used - 1) && now - block.t[used - 1] < ENDING_S) used--;
  let first = used;
  while (first > block.first && measured(first - 1) && block.t[first - 1] > after) first--;
  if (used - first < 2) return null;
  return {
    number: (last?.number ?? 0) + 1,
    start_s: block.t[first],
    end_s: block.t[used - 1],
    ratio: block.ratio[used - 1],
    standard_error: block.error[used - 1],
    kept: true,
    running: true,
  };
}

// [{ t (s from the start), ratio, error, statistic }] of rows of a block in [start, end]: at most `POINTS`. Of several rows the last
// one, and the highest statistic, so that no alarm is missed.
export function fromRows(block, start, end) {
  const first = indexOf(block, start - SLACK_S);
  const stop = indexOf(block, end + SLACK_S);
  const step = Math.max(1, Math.ceil((stop - first) / POINTS));
  const curve = [];
  for (let k = first; k < stop; k += step) {
    const last = Math.min(stop, k + step) - 1;
    let statistic = NaN;
    for (let i = k; i <= last; i++) {
      if (!(block.statistic[i] <= statistic)) statistic = block.statistic[i];
    }
    const ratio = block.ratio[last];
    if (Number.isNaN(ratio)) continue;
    curve.push({ t: block.t[last] - start, ratio, error: block.error[last], statistic });
  }
  return curve;
}

// A column of a block in [from, to] as pieces without a gap: [[t, value], ...] each; of many samples the lowest and the highest of
// each bin.
export function samplesIn(block, name, from, to) {
  const first = indexOf(block, from);
  const stop = indexOf(block, to + SLACK_S);
  const values = block[name];
  const step = Math.max(1, Math.ceil((stop - first) / SAMPLES));
  const pieces = [];
  let last = -1;
  for (let k = first; k < stop; k += step) {
    let low = k;
    let high = k;
    for (let i = k; i < Math.min(stop, k + step); i++) {
      if (!(values[i] >= values[low])) low = i;
      if (!(values[i] <= values[high])) high = i;
    }
    for (const i of new Set([Math.min(low, high), Math.max(low, high)])) {
      if (!Number.isFinite(values[i])) continue;
      if (last < 0 || !joins(block, last, i)) pieces.push([]);
      pieces.at(-1).push([block.t[i], values[i]]);
      last = i;
    }
  }
  return pieces;
}
