// One touch: its estimate in per cent of the present one, with its standard error; below it the CUSUM.

import { number, signed } from "../formatting.js";
import { truthOf } from "../instruction.js";
import { placed, placesOf, ticks, timeStep, wrapped } from "./axes.js";
import { unit } from "./sheet.js";
import { SvgChart, area, box, clipped, dot, label, line, measure, ruler } from "./svg.js";

const SCALES = [0.2, 0.5, 1, 2, 5, 10]; // per cent: steps, so that the eye learns them and nothing creeps
const BEGIN_S = 0.4; // the first estimates of a touch may be far away: they do not set the scale
const LONGEST = [2, 5, 7, 10, 15, 20, 30, 60, 120, 300, 600]; // s, where the length of a touch is not known
const CUSUM = "<title>CUSUM: the sum of what the estimate does not explain; above the dashed line the ratio has changed</title>";
const OVER = 1.04, LINES = 3;

export class TouchPlot extends SvgChart {
  title = document.getElementById("touchtitle");

  draw() {
    const [width, height] = this.size, found = this.charts.subject();
    this.shown = null;
    if (width < 60 || height < 50) return;
    if (!found || found.curve.length < 2) return this.empty(found);
    const shown = (this.shown = { ...found, ...this.layout(width, height, found) });
    const inner = this.axes(shown) + clipped(shown.left, 0, shown.right - shown.left, shown.base + 2, this.curves(shown)) + this.cusum(shown) + this.flags(shown) + this.value(shown);
    this.show(inner, this.name(shown));
    this.title.textContent = [`Touch ${found.touch.number}`, found.touch.specimen, `ratio, % from ${found.touch.running ? "now" : "its result"}`].filter(Boolean).join(" · ");
  }

  empty(found) {
    this.title.textContent = found ? `Touch ${found.touch.number}` : "Touch";
    this.write(found ? "The estimates of this touch are on their way." : "No touch yet. Press the probe on an object, and hold it.");
  }

  layout(width, height, { touch, curve, earlier }) {
    const k = unit(), left = 54 * k, right = width - 84 * k, foot = height - 18 * k, strip = Math.min(22 * k, 0.14 * height), base = foot - strip - 8 * k;
    const zero = touch.running ? curve.at(-1).ratio : touch.ratio, dev = ({ ratio }) => 100 * (ratio / zero - 1), se = ({ error }) => (Number.isFinite(error) ? 100 * Math.abs(error / zero) : 0);
    const settled = curve.filter(({ t }) => t > BEGIN_S), most = Math.max(0, ...(settled.length ? settled : curve.slice(-1)).map((p) => Math.abs(dev(p)) + se(p)));
    const scale = SCALES.find((step) => step >= most) ?? SCALES.at(-1);
    const last = Math.max(curve.at(-1).t, ...earlier.map((one) => one.at(-1).t)), length = Math.max(this.charts.known.hello.seconds ?? LONGEST.find((s) => s >= last) ?? last, curve.at(-1).t);
    const x = (t) => left + (t / length) * (right - left), y = (d) => base / 2 + 2 - (Math.max(-OVER, Math.min(OVER, d / scale)) * (base - 8)) / 2;
    return { k, left, right, foot, strip, base, zero, dev, se, scale, length, x, y, height };
  }

  axes({ k, left, right, foot, height, scale, length, x, y }) {
    const parts = [-1, -0.5, 0, 0.5, 1].map((share) => {
      const d = share * scale, text = d ? signed(d, placesOf(scale) + 1).replace(/(\.\d*?)0+$/, "$1").replace(/\.$/, "") : "0 %";
      return ruler(left, y(d), right, y(d), d ? "grid" : "past") + label(left - 6, y(d) + 4 * k, text, "", "end");
    });
    const step = timeStep(length, (right - left) / (50 * k));
    return parts.join("") + ticks(0, length, step).map((t) => ruler(x(t), 4, x(t), foot, "grid") + label(x(t), height - 4, `${t.toFixed(placesOf(step))} s`, "", "middle")).join("");
  }

  curves({ touch, curve, earlier, dev, se, x, y }) {
    const known = curve.filter(({ error }) => Number.isFinite(error)), edge = (sign) => known.map((p) => [x(p.t), y(dev(p) + sign * se(p))]);
    const own = (one) => (point) => 100 * (point.ratio / one.at(-1).ratio - 1); // an earlier touch: from its own result
    const past = earlier.map((one) => line(one.map((p) => [x(p.t), y(own(one)(p))]), "past", 1.1));
    return past.join("") + area(edge(1), edge(-1), "band") + line(curve.map((p) => [x(p.t), y(dev(p))]), touch.kept ? "ratio" : "bad");
  }

  cusum({ k, curve, left, right, foot, strip, x }) {
    const { threshold } = this.charts.known.hello, known = curve.filter(({ statistic }) => Number.isFinite(statistic));
    const top = 1.15 * (threshold ?? Math.max(1e-9, ...known.map(({ statistic }) => statistic))), g = (value) => foot - Math.min(1, value / top) * strip;
    const under = (value) => area(known.map((p) => [x(p.t), g(value(p))]), known.map((p) => [x(p.t), foot]), value === alarm ? "bad" : "past");
    const all = ({ statistic }) => statistic, alarm = ({ statistic }) => (statistic > threshold && threshold !== null ? statistic : 0);
    const limit = threshold ? ruler(left, g(threshold), right, g(threshold), "quiet", { dash: "5 4" }) + label(right + 6, g(threshold) + 4 * k, "change") : "";
    return ruler(left, foot, right, foot, "past") + limit + under(all) + under(alarm) + `<g>${CUSUM}${label(left - 6, foot - 6, "alarm", "", "end")}</g>`;
  }

  // A flag stands where it arises, with its sentence beside it (what to do after it is in the table).
  flags(shown) {
    const { k, touch, flags, left, right, base, x } = shown, height = 14 * k, edges = { left, right, top: 0, bottom: base };
    const wanted = flags.map(({ t_s, text, name }) => {
      const at = Math.max(left, Math.min(right, x(t_s - touch.start_s)));
      const lines = wrapped(`▲ ${(text || name).split(". ")[0]}`, 0.94 * (right - left), LINES, (part) => measure(part, k)), width = Math.max(...lines.map((one) => measure(one, k)));
      const room = lines.length * height, rows = [base - room / 2 - 2, room / 2]; // most touches come from above
      return { text: lines.join("\n"), lines, width, height: room, at, places: rows.flatMap((row) => [[at + 4, row], [at - 4 - width, row], [Math.max(left, Math.min(right - width, at - width / 2)), row]]) };
    });
    shown.labels = placed(wanted, edges);
    const texts = shown.labels.flatMap(({ x: a, y, lines }) => lines.map((one, i) => label(a, y + 4 * k + (i - (lines.length - 1) / 2) * height, one, "flagtext")));
    return wanted.map(({ at }) => ruler(at, 4, at, base, "bad", { dash: "2 3" })).join("") + texts.join("");
  }

  value({ k, touch, curve, se, x, y, zero }) {
    const end = curve.at(-1), edge = x(end.t) + 8;
    const error = Number.isFinite(end.error) ? label(edge, y(0) + 13 * k, `± ${number(se(end), se(end))} %`) : "";
    return label(edge, y(0) - 4, number(zero, touch.uncertainty ?? end.error), "value") + error;
  }

  name({ touch, curve, scale, flags, se }) {
    const end = curve.at(-1), sure = Number.isFinite(end.error) ? `, standard error ${number(se(end), se(end))} %` : "";
    const said = flags.map(({ text, name }) => text || name).join("; ");
    const now = touch.running ? "running" : `ratio ${number(touch.ratio, touch.uncertainty)}`;
    return `Touch ${touch.number}${touch.specimen ? `, ${touch.specimen}` : ""}: ${now}${sure}; scale from -${scale} to ${scale} %${said ? `; ${said}` : ""}`;
  }

  // What is at a place of the chart.
  at(px) {
    if (!this.shown || px < this.shown.left || px > this.shown.right) return null;
    const { curve, x, dev, touch, flags } = this.shown, point = curve.reduce((best, p) => (Math.abs(x(p.t) - px) < Math.abs(x(best.t) - px) ? p : best));
    const near = flags.filter(({ t_s }) => Math.abs(x(t_s - touch.start_s) - px) < 6).map(({ text, name }) => text || name);
    const statistic = Number.isFinite(point.statistic) ? [`CUSUM ${number(point.statistic)}`] : [];
    return { x: x(point.t), lines: [`${point.t.toFixed(2)} s`, `ratio ${number(point.ratio, point.error)}`, `${signed(dev(point), 2)} %`, ...statistic, ...near] };
  }
}

// The demo: estimate, its uncertainty and the truth, for the newest touches on each specimen.
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
    const inner = label(0, 12 * k, "Estimate ± (k = 1) and truth, % from the truth") + box(x(-3), top, x(3) - x(-3), foot - top, "fband") + ruler(x(0), top - 2, x(0), foot, "ink", { width: 2.4 }) + rows.join("") + scale.join("");
    this.show(inner, "Estimate and truth of the newest touches");
  }
}
