// Touches in time, with mean, standard deviation and slope: of a file the ratios of those that are found and count, else how far
// the kept ones are from the mean of their specimen.

import { clock } from "../formatting.js";
import { placesOf, stepOf, ticks, timeStep } from "./axes.js";
import { intervals } from "./intervals.js";
import { unit } from "./sheet.js";
import { SvgChart, box, clipped, label, line, ruler } from "./svg.js";

export class Trend extends SvgChart {
  // [title, [{ number, start_s, ratio: what is drawn }]]
  get shown() {
    const { known, tale } = this.charts, kept = known.used ?? tale.touches.filter((one) => one.kept !== false && one.ratio !== null), named = !known.used && kept.some(({ deviation }) => deviation);
    const shown = kept.map((touch) => ({ start_s: touch.start_s, ratio: named ? 100 * touch.deviation : touch.ratio, number: touch.number }));
    return [known.used ? "Those that count, in time" : named ? "Touches in time, % from their mean" : "Touches in time", shown];
  }

  draw() {
    const [width, height] = this.size, k = unit(), [title, shown] = this.shown, found = lineOf(shown), fit = Number.isFinite(found?.error) ? found : null, { origin_s: origin = 0 } = this.charts.known.hello, values = shown.map(({ ratio }) => ratio);
    if (width < 80 || height < 60) return;
    if (this.charts.known.hello.simulation?.demo) return this.show(intervals(this.charts.known.hello, this.charts.tale.all, this.size, k), "Estimate and truth of the newest touches");
    if (!shown.length) return this.write("Touches are compared here.");
    const [left, right, top, foot] = [48 * k, width - 4, 20 * k, height - 18 * k], [from, to] = [shown[0].start_s, Math.max(shown.at(-1).start_s, shown[0].start_s + 1)];
    const margin = 0.1 * (Math.max(...values) - Math.min(...values)) || 0.05 * Math.abs(values[0]) || 1, [low, high] = [Math.min(...values) - margin, Math.max(...values) + margin];
    const x = (t) => left + 4 + ((t - from) / (to - from)) * (right - left - 8), y = (value) => foot - ((value - low) / (high - low)) * (foot - top), step = stepOf(high - low, Math.max(2, (foot - top) / (26 * k)));
    const levels = ticks(low, high, step).map((one) => ruler(left, y(one), right, y(one), "grid") + label(left - 6, y(one) + 4 * k, one.toFixed(placesOf(step)), "", "end"));
    const times = ticks(from - origin, to - origin, timeStep(to - from, (right - left) / (60 * k))).map((t) => label(Math.min(x(t + origin), right - 24 * k), height - 4, clock(t), "", "middle"));
    const band = fit ? box(left, y(fit.mean + fit.spread), right - left, y(fit.mean - fit.spread) - y(fit.mean + fit.spread), "fband") + line([from, to].map((t) => [x(t), y(fit.mean + fit.rise * (t - fit.middle))]), "ratio") : "";
    const r = shown.length > 500 ? 1.2 : 2.4, here = shown.find(({ number }) => number === this.charts.known.chosen);
    const dots = `<path class="dot" d="${shown.map((one) => `M${(x(one.start_s) - r).toFixed(1)} ${y(one.ratio).toFixed(1)}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0-${2 * r} 0`).join("")}"/>${here ? `<circle class="newest" cx="${x(here.start_s)}" cy="${y(here.ratio)}" r="5"/>` : ""}`;
    this.show(label(0, 12 * k, `${title}${fit ? "; slope, ± s.d." : ""}`) + levels.join("") + times.join("") + clipped(left, top, right - left, foot - top, band + dots), `${title}: ${shown.length} touches`);
  }

  at() {
    return null;
  }
}

// Mean, standard deviation, and rise in a second with its error (of two not finite), of the ratios of two touches or more; else null.
export function lineOf(touches) {
  const n = touches.length, sum = (value) => touches.reduce((all, one) => all + value(one), 0);
  const mean = sum(({ ratio }) => ratio) / n, middle = sum(({ start_s: t }) => t) / n, square = sum(({ start_s: t }) => (t - middle) ** 2);
  const rise = sum(({ start_s: t, ratio }) => (t - middle) * (ratio - mean)) / square, left = sum(({ start_s: t, ratio }) => (ratio - mean - rise * (t - middle)) ** 2);
  return n > 1 ? { mean, middle, rise, spread: Math.sqrt(sum(({ ratio }) => (ratio - mean) ** 2) / (n - 1)), error: Math.sqrt(left / (n - 2) / square) } : null;
}
