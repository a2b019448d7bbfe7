// The estimate of a touch against its time: from the server's trace, or from the rows that are here.

import { MEASURED, indexOf } from "../store.js";

const POINTS = 400;
const ENDING_S = 0.5; // a touch that has just ended is shown on, until the server tells its result

// A touch that goes on: since its first row after the last completed touch. null: none.
export function runningOf(store, last) {
  const { block, now } = store, after = last?.end_s ?? -Infinity;
  let used = store.used;
  while (used > block.first && !(block.flags[used - 1] & MEASURED) && now - block.t[used - 1] < ENDING_S) used--;
  let first = used;
  while (first > block.first && block.flags[first - 1] & MEASURED && block.t[first - 1] > after) first--;
  return used - first < 2 ? null : { number: (last?.number ?? 0) + 1, start_s: block.t[first], end_s: block.t[used - 1], ratio: block.ratio[used - 1], standard_error: block.error[used - 1], kept: true, running: true };
}

// [{ t (s from the start), ratio, error, statistic }] of rows in [start, end]: at most so many; of several the last one, and
// the highest statistic, so that no alarm is missed.
export function fromRows({ block }, start, end) {
  const first = indexOf(block, start), stop = indexOf(block, end + 1e-6), step = Math.max(1, Math.ceil((stop - first) / POINTS)), curve = [];
  for (let k = first; k < stop; k += step) {
    const last = Math.min(stop, k + step) - 1;
    let statistic = NaN;
    for (let i = k; i <= last; i++) if (!(block.statistic[i] <= statistic)) statistic = block.statistic[i];
    if (!Number.isNaN(block.ratio[last])) curve.push({ t: block.t[last] - start, ratio: block.ratio[last], error: block.error[last], statistic });
  }
  return curve;
}

export function fromTrace({ t, ratio, error, statistic }) {
  return t.map((at, k) => ({ t: at, ratio: ratio[k] ?? NaN, error: error[k] ?? NaN, statistic: statistic?.[k] ?? NaN })).filter((point) => Number.isFinite(point.ratio));
}
