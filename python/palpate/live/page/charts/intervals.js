// The demo: estimate, its uncertainty and the truth, for the newest touches on each specimen.

import { signed } from "../formatting.js";
import { truthOf } from "../now.js";
import { unit } from "./sheet.js";
import { SvgChart, box, dot, label, ruler } from "./svg.js";

const RANGE = 8, SHOWN = 2; // per cent, both ways; touches of a specimen

export class Intervals extends SvgChart {
  draw() {
    const { known: { hello }, tale } = this.charts, [width, height] = this.size, k = unit();
    this.place.hidden = !hello.simulation?.demo;
    if (this.place.hidden || width < 80 || height < 60) return;
    const left = 56 * k, right = width - 10 * k, top = 22 * k, foot = height - 20 * k;
    const x = (d) => left + ((Math.max(-RANGE, Math.min(RANGE, d)) + RANGE) / (2 * RANGE)) * (right - left);
    const names = [...new Set(hello.simulation.truths.map(({ name }) => name))].toReversed(), high = (foot - top) / names.length;
    const one = (touch, y, newest) => {
      const { ratio } = truthOf(hello, touch), [d, e] = [touch.ratio - ratio, touch.uncertainty].map((value) => (100 * value) / ratio);
      return ruler(x(d - e), y, x(d + e), y, newest ? "ratio" : "past", { width: newest ? 2.2 : 1 }) + dot(x(d), y, (newest ? 4.5 : 3) * k, newest, "past");
    };
    const rows = names.map((name, row) => {
      const y = top + (row + 0.5) * high, known = tale.all.filter(({ specimen, uncertainty }) => specimen === name && uncertainty).slice(-SHOWN).toReversed();
      return label(0, y + 4 * k, name, "value") + known.map((touch, i) => one(touch, y + (i ? 6 : -5) * k, !i)).join("");
    });
    const scale = [-6, -3, 0, 3, 6].map((d) => label(x(d), height - 5 * k, signed(d, 0), "", "middle"));
    const inner = label(0, 12 * k, "Estimate ± and truth, % from the truth") + box(x(-3), top, x(3) - x(-3), foot - top, "fband") + ruler(x(0), top - 2, x(0), foot, "ink", { width: 2.4 }) + rows.join("") + scale.join("");
    this.show(inner, "Estimate and truth of the newest touches");
  }
}
