// What happened in the measurement: touches, marks, tares, gaps, judgements, flags, as the server tells them, and the courses of touches.

import { MEASURED, indexOf } from "../store.js";

export class Tale {
  // known: the newest message of each kind
  constructor(known) {
    this.known = known;
    this.clear();
  }

  clear() {
    this.running = null; // the touch that goes on
    this.courses = new Map(); // touch -> fromRows() of it
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
    return this.all.find(({ start_s, end_s }) => start_s <= t && t <= end_s) ?? this.all.find(({ start_s, end_s }) => start_s - near <= t && t <= end_s + near) ?? null;
  }

  // Sentences for what is at a moment, or `near` it.
  said(t, near) {
    const touch = this.touchAt(t, near), close = (at) => Math.abs(at - t) <= near, { marks, tares, gaps, judgements, flags } = this.events;
    return [
      touch ? [`touch ${touch.number}`, touch.specimen, touch.kept ? null : `left out: ${touch.why}`].filter(Boolean).join(", ") : null,
      ...gaps.filter(({ from_s, to_s }) => from_s - near <= t && t <= to_s + near).map(({ lost, text }) => text || `gap, ${lost} lost`),
      ...marks.filter(({ t_s }) => close(t_s)).map(({ text }) => text || "mark"),
      ...(tares.some(close) ? ["tare"] : []),
      ...[...judgements, ...flags].filter(({ t_s }) => close(t_s)).map(({ text }) => text),
    ].filter(Boolean);
  }

  counted() {
    const { marks, tares, gaps } = this.events, out = this.touches.filter(({ kept }) => !kept).length, many = (n, word) => `${n} ${word}${n === 1 ? "" : "s"}`;
    return [`${many(this.touches.length, "touch").replace("touchs", "touches")}${out ? ` (${out} left out)` : ""}`, many(marks.length, "mark"), many(gaps.length, "gap"), many(tares.length, "tare")].join(", ");
  }
}

const POINTS = 400, SLACK_S = 1e-6; // the times of rows and of touches are rounded
const ENDING_S = 0.5; // a touch that has just ended is shown on, until the server tells its result

// A touch that goes on: since its first row after the last completed touch. null: none.
export function runningOf(store, last) {
  const { block } = store, now = block.t[store.used - 1], after = last?.end_s ?? -Infinity;
  let used = store.used;
  while (used > block.first && !(block.flags[used - 1] & MEASURED) && now - block.t[used - 1] < ENDING_S) used--;
  let first = used;
  while (first > block.first && block.flags[first - 1] & MEASURED && block.t[first - 1] > after) first--;
  return used - first < 2 ? null : { number: (last?.number ?? 0) + 1, start_s: block.t[first], end_s: block.t[used - 1], ratio: block.ratio[used - 1], standard_error: block.error[used - 1], kept: true, running: true };
}

// [{ t (s from the start), ratio, error, statistic }] of rows of a block in [start, end]: at most so many; of several the last one, and
// the highest statistic, so that no alarm is missed.
export function fromRows(block, start, end) {
  const first = indexOf(block, start - SLACK_S), stop = indexOf(block, end + SLACK_S), step = Math.max(1, Math.ceil((stop - first) / POINTS)), curve = [];
  for (let k = first; k < stop; k += step) {
    const last = Math.min(stop, k + step) - 1;
    let statistic = NaN;
    for (let i = k; i <= last; i++) if (!(block.statistic[i] <= statistic)) statistic = block.statistic[i];
    if (!Number.isNaN(block.ratio[last])) curve.push({ t: block.t[last] - start, ratio: block.ratio[last], error: block.error[last], statistic });
  }
  return curve;
}
