// Lines through many rows: where several fall on a pixel, its lowest, highest and last value give the same picture as all
// of them (Jugel, Jerzak, Hackenbroich and Markl, PVLDB 7, 797, 2014).

import { indexOf } from "../store.js";

const GAP_S = 0.5; // samples further apart are not joined by a line
const THICK = 1.6; // pixels
const CHUNK = 32; // points in a path: Chromium without a graphics card takes 8 ms for 4,600 points so, 130 ms for one path

// Rows of [from, to], and the one before and after.
export function span(block, from, to) {
  return [
    Math.max(block.first, indexOf(block, from) - 1),
    Math.min(block.end, indexOf(block, to) + 1),
  ];
}

// Draws a column of a block in [first, end), in the colour of its name. x, y: functions from s and pF to pixels. Returns the number
// of points, which the width in pixels bounds. Many rows are drawn as bars, which is fast everywhere.
export function trace(canvas, name, block, rows, x, y) {
  const { t } = block;
  const [first, end] = rows;
  const dense = end - first > x(t[end - 1]) - x(t[first]); // rows, pixels
  return dense
    ? bars(canvas, name, block, block[name], rows, x, y)
    : curve(canvas, name, block, block[name], rows, x, y);
}

// Whether a line goes from row j to row k: also over samples without a value, if that is short.
export function joins({ t, bin }, j, k) {
  return t[k] - t[j] <= Math.max(GAP_S, 2 * bin);
}

function curve(canvas, colour, block, values, [first, end], x, y) {
  const { t } = block;
  let path = new Path2D();
  let points = 0;
  let last = -1;
  for (let k = first; k < end; k++) {
    if (values[k] !== values[k]) continue; // NaN
    const [px, py] = [x(t[k]), y(values[k])];
    if (last >= 0 && joins(block, last, k)) path.lineTo(px, py);
    else path.rect(px - 0.4, py - 0.4, 0.8, 0.8); // seen also if it stands alone
    last = k;
    if (++points % CHUNK) continue;
    canvas.stroke(colour, path);
    path = new Path2D();
    path.moveTo(px, py);
  }
  canvas.stroke(colour, path);
  return points;
}

// For each pixel a bar from the lowest to the highest value; it begins where the one before it ended. under: from zero.
export function bars(canvas, colour, block, values, [first, end], x, y, under = false) {
  const { t } = block;
  const { context } = canvas;
  let points = 0;
  let column = NaN;
  let low = 0;
  let high = 0;
  let last = -1;
  const draw = (width) => {
    const top = y(high);
    const height = under ? y(0) - top : Math.max(THICK, y(low) - top);
    context.fillRect(column, top - (height === THICK ? THICK / 2 : 0), width, height);
    points++;
  };
  context.fillStyle = canvas.colour(colour);
  for (let k = first; k < end; k++) {
    const value = values[k];
    if (value !== value) continue;
    const here = Math.floor(x(t[k]));
    if (here !== column) {
      const joined = last >= 0 && joins(block, last, k);
      const from = joined ? values[last] : value;
      if (last >= 0) draw(joined ? here - column : 1);
      [column, low, high] = [here, Math.min(from, value), Math.max(from, value)];
    } else if (value < low) low = value;
    else if (value > high) high = value;
    last = k;
  }
  if (last >= 0) draw(1);
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
