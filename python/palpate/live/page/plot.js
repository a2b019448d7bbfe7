// Lines through many rows: of each column of pixels at most four points, and still every pixel is the right one
// (first, lowest, highest, last: M4; Jugel, Jerzak, Hackenbroich and Markl, PVLDB 7, 797, 2014).

import { indexOf } from "./store.js";

const GAP_S = 0.5; // samples further apart are not joined by a line

// Rows of [from, to], and the one before and after.
export function span(block, from, to) {
  return [Math.max(block.first, indexOf(block, from) - 1), Math.min(block.end, indexOf(block, to) + 1)];
}

// Adds a column of a block to a path. x, y: functions from s and pF to pixels. Returns the number of points.
export function trace(path, block, name, [first, end], x, y) {
  const { t } = block, values = block[name], gap = Math.max(GAP_S, 2 * block.bin);
  let points = 0, joined = false, column = NaN, low = 0, high = 0, last = -1;
  const add = (k) => {
    if (joined) path.lineTo(x(t[k]), y(values[k]));
    else path.moveTo(x(t[k]), y(values[k]));
    joined = true;
    points++;
  };
  const close = () => {
    if (last < 0) return;
    for (const k of low < high ? [low, high] : [high, low]) if (k !== start && k !== last) add(k);
    if (last !== start) add(last);
    last = -1;
  };
  let start = -1;
  for (let k = first; k < end; k++) {
    const known = values[k] === values[k], broken = k > first && t[k] - t[k - 1] > gap; // not NaN
    if (!known || broken) {
      close();
      joined = false;
      column = NaN;
      if (!known) continue;
    }
    const here = Math.floor(x(t[k]));
    if (here !== column) {
      close();
      add((start = low = high = last = k));
      column = here;
    } else {
      if (values[k] < values[low]) low = k;
      if (values[k] > values[high]) high = k;
      last = k;
    }
  }
  close();
  return points;
}

// Lowest and highest value of columns of a block.
export function extremes(block, names, [first, end], into = [Infinity, -Infinity]) {
  for (const name of names) {
    const values = block[name];
    for (let k = first; k < end; k++) {
      if (values[k] < into[0]) into[0] = values[k];
      if (values[k] > into[1]) into[1] = values[k];
    }
  }
  return into;
}

// Index of the row of a block that is nearest in time, or -1.
export function nearest(block, time) {
  if (block.first === block.end) return -1;
  const k = Math.min(indexOf(block, time), block.end - 1);
  return k > block.first && time - block.t[k - 1] < block.t[k] - time ? k - 1 : k;
}
