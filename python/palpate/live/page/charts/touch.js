// One touch in the Lab: its estimate in per cent of its result, with its noise; below it the detector.

import { number, signed } from "../formatting.js";
import { truthOf } from "../reading.js";
import { placed, placesOf, ticks, timeStep } from "./axes.js";
import { unit } from "./canvas.js";
import { cutMarks, detectorStrip, estimateCurve, percentAxis, percentages } from "./estimate.js";
import { SvgChart, box, clipped, dot, label, line, measure, ruler } from "./svg.js";

const LONGEST = [2, 5, 7, 10, 15, 20, 30, 60, 120, 300, 600]; // s, where the length of a touch is not known

export class TouchPlot extends SvgChart {
  title = document.getElementById("touchtitle");

  draw() {
    const [width, height] = this.size;
    const found = this.charts.subject();
    this.shown = null;
    if (width < 60 || height < 50) return;
    if (!found || found.curve.length < 2) {
      this.empty(found);
      return;
    }
    const { touch } = found;
    const shown = { ...found, ...this.layout(width, height, found) };
    this.shown = shown;
    const { left, right, base } = shown;
    const curves = clipped(left, 0, right - left, base + 2, this.curves(shown));
    const parts = [this.axes(shown), curves, cutMarks(shown), this.detector(shown)];
    this.show(parts.join("") + this.flags(shown) + this.value(shown), this.name(shown));
    const reference = touch.running ? "now" : "its result";
    const words = [`Touch ${touch.number}`, touch.specimen, `ratio, % from ${reference}`];
    this.title.textContent = words.filter(Boolean).join(" · ");
  }

  empty(found) {
    this.title.textContent = found ? `Touch ${found.touch.number}` : "Touch";
    this.write(
      found
        ? "The estimates of this touch are on their way."
        : "No touch yet. Press the probe on an object, and hold it.",
    );
  }

  layout(width, height, found) {
    const k = unit();
    const left = 54 * k;
    const right = width - 84 * k;
    const foot = height - 18 * k;
    const strip = Math.min(22 * k, 0.14 * height);
    const base = foot - strip - 8 * k;
    const known = percentages(found);
    const end = found.curve.at(-1).t;
    const last = Math.max(end, ...found.earlier.map((one) => one.at(-1).t));
    const usual = LONGEST.find((seconds) => seconds >= last) ?? last;
    const length = Math.max(this.charts.known.hello.seconds ?? usual, end);
    const x = (t) => left + (t / length) * (right - left);
    const y = percentAxis(known.scale, 6, base - 2);
    return { k, left, right, top: 6, foot, strip, base, ...known, length, x, y, height };
  }

  axes({ k, left, right, foot, height, scale, length, x, y }) {
    const parts = [];
    for (const share of [-1, -0.5, 0, 0.5, 1]) {
      const percent = share * scale;
      const text = percent ? signed(Number(percent.toPrecision(2)), placesOf(scale / 2)) : "0 %";
      parts.push(ruler(left, y(percent), right, y(percent), percent ? "grid" : "past"));
      parts.push(label(left - 6, y(percent) + 4 * k, text, "", "end"));
    }
    const step = timeStep(length, (right - left) / (50 * k));
    for (const t of ticks(0, length, step)) {
      parts.push(ruler(x(t), 4, x(t), foot, "grid"));
      parts.push(label(x(t), height - 4, `${t.toFixed(placesOf(step))} s`, "", "middle"));
    }
    return parts.join("");
  }

  // The touches before on the same specimen, each from its own result, and this one.
  curves(shown) {
    const { earlier, x, y } = shown;
    const past = earlier.map((one) => {
      const result = one.at(-1).ratio;
      const points = one.map(({ t, ratio }) => [x(t), y(100 * (ratio / result - 1))]);
      return line(points, "past", 1.1);
    });
    return past.join("") + estimateCurve(shown);
  }

  detector(shown) {
    const { k, left, foot } = shown;
    const { threshold } = this.charts.known.hello;
    return detectorStrip({ ...shown, threshold }) + label(left - 6, foot - 6, "CUSUM", "", "end");
  }

  // A flag is named where it arises; its sentence is in the table, and in Explain.
  flags(shown) {
    const { k, touch, flags, left, right, base, x } = shown;
    const height = 14 * k;
    const rows = [base - height / 2 - 2, height / 2]; // most touches come from above
    const wanted = flags.map(({ t_s, name }) => {
      const at = Math.max(left, Math.min(right, x(t_s - touch.start_s)));
      const text = `▲ ${name}`;
      const width = measure(text, k);
      const places = rows.flatMap((row) => [
        [at + 4, row],
        [at - 4 - width, row],
      ]);
      return { text, width, height, at, places };
    });
    shown.labels = placed(wanted, { left, right, top: 0, bottom: base });
    const lines = wanted.map(({ at }) => ruler(at, 4, at, base, "bad", { dash: "2 3" }));
    const texts = shown.labels.map((one) => label(one.x, one.y + 4 * k, one.text, "flagtext"));
    return lines.join("") + texts.join("");
  }

  // The result with its whole uncertainty: the one that stands everywhere.
  value({ k, touch, curve, x, y, zero }) {
    const edge = x(curve.at(-1).t) + 8;
    const percent = Math.abs((100 * touch.uncertainty) / zero);
    const uncertainty = touch.uncertainty ? `± ${number(percent, percent)} %` : "";
    const ratio = label(edge, y(0) - 4, number(zero, touch.uncertainty), "value");
    return ratio + label(edge, y(0) + 13 * k, uncertainty);
  }

  name({ touch, curve, scale, flags, error }) {
    const end = curve.at(-1);
    const noise = Number.isFinite(end.error) ? `, noise ${number(error(end), error(end))} %` : "";
    const names = flags.map(({ name }) => name).join(", ");
    const specimen = touch.specimen ? `, ${touch.specimen}` : "";
    const now = touch.running ? "running" : `ratio ${number(touch.ratio, touch.uncertainty)}`;
    const flagged = names ? `; ${names}` : "";
    return `Touch ${touch.number}${specimen}: ${now}${noise}; scale from -${scale} to ${scale} %${flagged}`;
  }

  // What is at a place of the chart.
  at(px) {
    if (!this.shown || px < this.shown.left || px > this.shown.right) return null;
    const { curve, x, deviation, touch, flags } = this.shown;
    const away = ({ t }) => Math.abs(x(t) - px);
    const point = curve.reduce((best, one) => (away(one) < away(best) ? one : best));
    const near = flags.filter(({ t_s }) => Math.abs(x(t_s - touch.start_s) - px) < 6);
    const lines = [
      `${point.t.toFixed(2)} s`,
      `ratio ${number(point.ratio, point.error)}`,
      `${signed(deviation(point), 2)} %`,
    ];
    if (Number.isFinite(point.statistic)) lines.push(`CUSUM ${number(point.statistic)}`);
    lines.push(...near.map(({ text, name }) => text || name));
    return { x: x(point.t), lines };
  }
}

// The demo: estimate, its uncertainty and the truth, for the newest touches on each specimen.
const RANGE = 8; // per cent, both ways
const SHOWN = 2; // touches of a specimen

export class Intervals extends SvgChart {
  draw() {
    const { hello } = this.charts.known;
    const [width, height] = this.size;
    const k = unit();
    this.place.hidden = !hello.simulation?.demo;
    if (this.place.hidden || width < 80 || height < 60) return;
    const left = 56 * k;
    const right = width - 10 * k;
    const top = 22 * k;
    const foot = height - 20 * k;
    const x = (percent) => left + ((percent + RANGE) / (2 * RANGE)) * (right - left);
    const names = [...new Set(hello.simulation.truths.map(({ name }) => name))].toReversed();
    const high = (foot - top) / names.length;
    const rows = names.map((name, row) => {
      const y = top + (row + 0.5) * high;
      const own = this.charts.annotations.all.filter((one) => one.specimen === name);
      const known = own.filter(({ uncertainty }) => uncertainty).slice(-SHOWN);
      const drawn = known.toReversed().map((touch, i) => {
        return this.interval(touch, { x, y: y + (i ? 6 : -5) * k, newest: !i, k, left, right });
      });
      return label(0, y + 4 * k, name, "value") + drawn.join("");
    });
    const scale = [-6, -3, 0, 3, 6].map((percent) =>
      label(x(percent), height - 5 * k, signed(percent, 0), "", "middle"),
    );
    const inner =
      label(0, 12 * k, "Estimate ± (k = 1) and truth, % from the truth") +
      box(x(-3), top, x(3) - x(-3), foot - top, "fband") +
      ruler(x(0), top - 2, x(0), foot, "ink", { width: 2.4 }) +
      rows.join("") +
      scale.join("");
    this.show(inner, "Estimate and truth of the newest touches");
  }

  // The interval of a touch; beyond the scale it is cut, and an arrow says how far it is.
  interval(touch, { x, y, newest, k, left, right }) {
    const { ratio } = truthOf(this.charts.known.hello, touch);
    const middle = (100 * (touch.ratio - ratio)) / ratio;
    const half = (100 * touch.uncertainty) / ratio;
    const within = (px) => Math.max(left, Math.min(right, px));
    const colour = newest ? "ratio" : "past";
    const bar = ruler(within(x(middle - half)), y, within(x(middle + half)), y, colour, {
      width: newest ? 2.2 : 1,
    });
    if (Math.abs(middle) <= RANGE)
      return bar + dot(x(middle), y, (newest ? 4.5 : 3) * k, newest, "past");
    const text = middle > 0 ? `${signed(middle, 0)} % →` : `← ${signed(middle, 0)} %`;
    const edge = middle > 0 ? right : left;
    return bar + label(edge, y + 4 * k, text, "cut", middle > 0 ? "end" : "start");
  }
}
