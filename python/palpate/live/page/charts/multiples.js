// All touches small beside the running one: a row for each specimen, the same scale for all.

import { number, signed } from "../formatting.js";
import { shortened } from "./axes.js";
import { inside, unit } from "./sheet.js";
import { SvgChart, box, clipped, label, line, measure, ruler } from "./svg.js";

const RANGE = 8; // per cent, both ways
const MANY = 8; // touches in a line without specimens
const LEAST = 44, MOST = 100; // height of a row, px at 15 px text

export class Multiples extends SvgChart {
  cells = [];

  constructor(place, charts, part) {
    super(place, charts, part);
    place.addEventListener("click", (event) => {
      const cell = this.cellAt(...inside(place, event));
      if (cell) charts.choose(cell.touch.number);
    });
  }

  // Specimens with touches, the newest first.
  groups() {
    const found = new Map();
    for (const touch of this.charts.tale.all.toReversed()) {
      const name = touch.specimen ?? "";
      found.set(name, found.get(name) ?? []).get(name).push(touch);
    }
    return [...found].map(([name, newest]) => ({ name, list: newest.reverse() })).map(({ name, list }) => ({ name, list, mean: name ? meanOf(list) : null }));
  }

  draw() {
    const [width, height] = this.size, k = unit(), groups = this.groups();
    this.cells = [];
    if (width < 80 || height < 40) return;
    if (!groups.length) return this.write("Touches are compared here.");
    const named = groups.some(({ name }) => name), head = 18 * k, left = named ? 56 * k : 0;
    const longest = named ? Math.max(4, ...groups.map(({ list }) => list.length)) : MANY;
    const columns = Math.max(2, Math.min(longest, Math.floor((width - left) / (56 * k))));
    const rows = Math.max(1, Math.min(MOST, Math.floor((height - head) / (LEAST * k))));
    const lines = groups.flatMap((group) => this.rowsOf(group, columns, groups.length > 1 ? 1 : rows)).slice(0, rows);
    const high = Math.min((height - head) / lines.length, MOST * k), wide = (width - left) / columns;
    const inner = lines.map((one, row) => this.row(one, { left, wide, high, k, top: head + row * high }));
    const scatter = this.charts.known.hello.scatter ? "; band: scatter" : "", from = named ? "the mean" : "its result";
    this.show(label(0, 12 * k, `Touches, % from ${from}; ±${RANGE} %${scatter}`) + inner.join(""), this.name(groups));
  }

  // The newest touches of a specimen, in lines of so many.
  rowsOf({ name, list, mean }, columns, most) {
    const shown = list.slice(-columns * most), lines = [];
    for (let i = 0; i < shown.length; i += columns) lines.push({ name: i ? "" : name, mean, list: shown.slice(i, i + columns) });
    return lines;
  }

  row({ name, list, mean }, { left, wide, high, k, top }) {
    const title = name ? label(0, top + 14 * k, shortened(name, left - 6, (part) => measure(part, k)), "value") : "";
    return title + list.map((touch, i) => this.cell(touch, mean, { x: left + i * wide, y: top + 2, width: wide - 6 * k, height: high - 20 * k }, k)).join("");
  }

  cell(touch, mean, place, k) {
    const { x, y, width, height } = place, curve = this.charts.curveOf(touch), { seconds, scatter } = this.charts.known.hello;
    const zero = mean ?? touch.ratio, length = Math.max(seconds ?? 0, curve.at(-1)?.t ?? 1), share = mean === null ? null : 100 * (touch.ratio / mean - 1);
    const level = (d) => y + height / 2 - (Math.max(-RANGE, Math.min(RANGE, d)) / RANGE) * (height / 2 - 2), s = 100 * (scatter ?? 0);
    const points = curve.map((p) => [x + (p.t / length) * width, level(100 * (p.ratio / zero - 1))]);
    this.cells.push({ ...place, touch, share });
    const inner = box(x, level(s), width, level(-s) - level(s), "fband") + ruler(x, y + height / 2, x + width, y + height / 2, "grid0") + line(points, touch.kept ? "ratio" : "bad");
    const foot = y + height + 13 * k, n = String(touch.number), out = touch.kept ? "value" : "flagtext";
    const more = share === null || measure(`${n} ${signed(share, 1)}`, k) > width ? "" : label(x + measure(`${n} `, k) + 2, foot, signed(share, 1));
    return clipped(x, y, width, height, inner) + (touch.kept ? "" : label(x + 2, y + 11 * k, "▲", "flagtext")) + label(x, foot, n, out) + more;
  }

  name(groups) {
    const said = ({ number: n, ratio, kept }, mean) => `${n} ${mean ? `${signed(100 * (ratio / mean - 1), 1)} %` : number(ratio)}${kept ? "" : " (left out)"}`;
    return `Touches by specimen. ${groups.slice(0, 6).map(({ name, list, mean }) => `${name || "no specimen"}: ${list.slice(-8).map((one) => said(one, mean)).join(", ")}`).join(". ")}`;
  }

  cellAt(x, y) {
    return this.cells.find((one) => x >= one.x && x <= one.x + one.width && y >= one.y && y <= one.y + one.height + 18);
  }

  at(x, y) {
    const cell = this.cellAt(x, y);
    if (!cell) return null;
    const { touch, share } = cell, result = number(touch.ratio, touch.uncertainty);
    return { x: cell.x, lines: [[`touch ${touch.number}`, touch.specimen].filter(Boolean).join(", "), `ratio ${result}`, share === null ? "" : `${signed(share, 1)} % from the mean`, touch.kept ? "" : `left out: ${touch.why}`].filter(Boolean) };
  }
}

// Of the kept touches; of all where none is kept.
function meanOf(list) {
  const kept = list.filter(({ kept: is, running }) => is && !running), used = kept.length ? kept : list;
  return used.reduce((sum, { ratio }) => sum + ratio, 0) / used.length;
}
