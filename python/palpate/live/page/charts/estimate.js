// The estimate of one touch, as the charts of Lab and Explain draw it: its distance from the result, its noise, and the detector.

import { number, signed } from "../formatting.js";
import { placesOf } from "./axes.js";
import { area, label, line, ruler } from "./svg.js";

const SCALES = [0.2, 0.5, 1, 2, 5, 10]; // per cent: steps, so that the eye learns them and nothing creeps
const BEGIN_S = 0.4; // the first estimates of a touch may be far away: they do not set the scale
const FAR = 20; // scales: a curve further away is drawn here, out of sight
const DETECTOR =
  "<title>CUSUM: the sum of what the estimate does not explain; above the dashed line the ratio has changed</title>";

// Distances in per cent: deviation(point) from the result, error(point), and the scale that has them after the first moments.
export function percentages({ touch, curve }) {
  const zero = touch.running ? curve.at(-1).ratio : touch.ratio;
  const deviation = ({ ratio }) => 100 * (ratio / zero - 1);
  const error = (point) => (Number.isFinite(point.error) ? 100 * Math.abs(point.error / zero) : 0);
  const settled = curve.filter(({ t }) => t > BEGIN_S);
  const counted = settled.length ? settled : curve.slice(-1);
  const most = Math.max(0, ...counted.map((point) => Math.abs(deviation(point)) + error(point)));
  const scale = SCALES.find((step) => step >= most) ?? SCALES.at(-1);
  return { zero, deviation, error, scale };
}

// The scale of a chart: from -scale to scale in [top, base]. What is beyond it is for the caller to cut.
export function percentAxis(scale, top, base) {
  const middle = (top + base) / 2;
  return (percent) => {
    const share = Math.max(-FAR, Math.min(FAR, percent / scale));
    return middle - (share * (base - top)) / 2;
  };
}

// The curve with its noise as a band.
export function estimateCurve({ touch, curve, deviation, error, x, y }) {
  const known = curve.filter((point) => Number.isFinite(point.error));
  const edge = (sign) => known.map((p) => [x(p.t), y(deviation(p) + sign * error(p))]);
  const middle = curve.map((p) => [x(p.t), y(deviation(p))]);
  return area(edge(1), edge(-1), "band") + line(middle, touch.kept ? "ratio" : "bad");
}

// An arrow at each edge that the curve crosses, with its furthest value there.
export function cutMarks({ k, curve, deviation, scale, x, top, base, left, right }) {
  const found = [];
  for (const sign of [1, -1]) {
    const beyond = curve.filter((point) => sign * deviation(point) > scale);
    if (!beyond.length) continue;
    const furthest = beyond.reduce((a, b) => (sign * deviation(b) > sign * deviation(a) ? b : a));
    const places = scale < 1 ? placesOf(scale) : 0;
    const text = `${sign > 0 ? "↑" : "↓"} ${signed(deviation(furthest), places)} %`;
    const at = Math.max(left + 6 * k, Math.min(right - 60 * k, x(furthest.t) + 4));
    found.push(label(at, sign > 0 ? top + 12 * k : base - 4, text, "cut"));
  }
  return found.join("");
}

// The statistic of the detector in a strip above `foot`; the part above its threshold stands out.
export function detectorStrip({ k, curve, threshold, left, right, foot, strip, x }) {
  const known = curve.filter(({ statistic }) => Number.isFinite(statistic));
  const highest = Math.max(1e-9, ...known.map(({ statistic }) => statistic));
  const top = 1.15 * (threshold ?? highest);
  const y = (value) => foot - Math.min(1, value / top) * strip;
  const ground = known.map((p) => [x(p.t), foot]);
  const all = known.map((p) => [x(p.t), y(p.statistic)]);
  const alarms = known.map((p) => [x(p.t), p.statistic > threshold ? y(p.statistic) : foot]);
  const parts = [ruler(left, foot, right, foot, "past"), area(all, ground, "past")];
  if (threshold) {
    parts.push(area(alarms, ground, "bad"));
    parts.push(ruler(left, y(threshold), right, y(threshold), "quiet", { dash: "5 4" }));
    if (highest > top) {
      const peak = known.find(({ statistic }) => statistic === highest);
      const at = Math.max(left, Math.min(right - 40 * k, x(peak.t)));
      parts.push(label(at, foot - strip + 10 * k, `↑ ${number(highest)}`, "cut"));
    }
  }
  return `<g>${DETECTOR}${parts.join("")}</g>`;
}
