// Three charts over one time axis: changes, ratio with its standard error, statistic with its threshold.

import { ALARM } from "./store.js";

const uPlot = window.uPlot;
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
const HEIGHTS = [128, 176, 112];
const GAP_S = 0.5; // samples further apart are not joined by a line

export class Charts {
  constructor(places) {
    this.places = places; // { changes, ratios, statistics }: elements
    this.threshold = null;
    this.marks = [];
    this.alarms = []; // [from, to] in seconds
    this.plots = [];
    new ResizeObserver(() => this.fit()).observe(places.changes);
  }

  // Builds the charts; again after a change of theme, because a canvas keeps its colours.
  build() {
    this.plots.forEach((plot) => plot.destroy());
    const line = (name, more = {}) => ({ stroke: colour(name), width: 1.6, points: { show: false }, ...more });
    const edge = { stroke: "transparent", points: { show: false } };
    const threshold = line("quiet", { width: 1.2, dash: [6, 4] });
    this.plots = [
      this.plot(this.places.changes, [line("hard"), line("soft")], { range: spread }),
      this.plot(this.places.ratios, [edge, edge, line("ratio", { width: 2 })], {
        range: (_, low, high) => this.ratioRange ?? spread(_, low, high),
        bands: [{ series: [1, 2], fill: colour("band") }],
      }),
      this.plot(this.places.statistics, [line("statistic"), threshold], { range: (_, low, high) => upward(high) }),
    ];
    this.fit();
  }

  plot(place, series, { range, bands = [] }) {
    const axis = { stroke: colour("quiet"), grid: { stroke: colour("grid"), width: 1 }, ticks: { show: false }, font: "12px system-ui, sans-serif" };
    const options = {
      width: 300, height: 150, bands, pxAlign: false,
      cursor: { show: false }, legend: { show: false },
      scales: { x: { time: false }, y: { range } },
      axes: [{ ...axis, size: 26, values: (_, ticks) => ticks.map((tick) => `${tick} s`) }, { ...axis, size: 58, space: 26 }],
      series: [{}, ...series],
      hooks: { drawClear: [(plot) => this.shade(plot)], draw: [(plot) => this.drawMarks(plot)] },
    };
    return new uPlot(options, [[], ...series.map(() => [])], place);
  }

  fit() {
    this.plots.forEach((plot, i) => plot.setSize({ width: plot.root.parentElement.clientWidth, height: HEIGHTS[i] }));
  }

  draw(store, seconds) {
    const { size, columns, flags } = store.thinned(seconds, seconds / this.plots[0].bbox.width);
    const { t, hard, soft, ratio, error, statistic } = columns, origin = store.origin ?? 0;
    const [x, h, s, r, low, high, g, limit] = Array.from({ length: 8 }, () => new Array(size));
    this.alarms = [];
    for (let i = 0; i < size; i++) {
      const gap = i > 0 && t[i] - t[i - 1] > GAP_S;
      const known = (value) => (gap || Number.isNaN(value) ? null : value);
      x[i] = t[i] - origin;
      h[i] = known(hard[i]); s[i] = known(soft[i]); r[i] = known(ratio[i]); g[i] = known(statistic[i]);
      low[i] = known(ratio[i] - error[i]); high[i] = known(ratio[i] + error[i]);
      limit[i] = this.threshold;
      if (flags[i] & ALARM) this.addAlarm(x[i], i ? x[i - 1] : x[i], gap);
    }
    this.ratioRange = middle(r, low);
    const until = Math.max(store.now - origin, seconds);
    this.show([[x, h, s], [x, low, high, r], [x, g, limit]], until - seconds, until);
  }

  addAlarm(now, before, gap) {
    const last = this.alarms.at(-1);
    if (last && last[1] === before && !gap) last[1] = now;
    else this.alarms.push([before, now]);
  }

  show(data, min, max) {
    this.plots.forEach((plot, i) => plot.batch(() => {
      plot.setData(data[i], false);
      plot.setScale("x", { min, max });
    }));
  }

  shade(plot) {
    const { left, top, width, height } = plot.bbox;
    plot.ctx.fillStyle = colour("alarm");
    for (const [from, to] of this.alarms) {
      const a = Math.max(plot.valToPos(from, "x", true), left), b = Math.min(plot.valToPos(to, "x", true), left + width);
      if (b > a) plot.ctx.fillRect(a, top, b - a, height);
    }
  }

  drawMarks(plot) {
    const { left, top, width, height } = plot.bbox, { ctx } = plot;
    ctx.save();
    ctx.fillStyle = ctx.strokeStyle = colour("quiet");
    ctx.font = `${12 * devicePixelRatio}px system-ui, sans-serif`;
    for (const { at, text } of this.marks) {
      const x = plot.valToPos(at, "x", true);
      if (x < left || x > left + width) continue;
      ctx.fillRect(x, top, devicePixelRatio, height);
      if (plot === this.plots[0]) ctx.fillText(text.slice(0, 24), x + 4 * devicePixelRatio, top + 12 * devicePixelRatio);
    }
    ctx.restore();
  }
}

function spread(_, low, high) {
  if (low === null || high === null) return [-0.01, 0.1];
  const margin = Math.max((high - low) * 0.08, 0.002);
  return [low - margin, high + margin];
}

function upward(high) {
  return [0, Math.max(high ?? 0, 1e-6) * 1.15];
}

// Range of the ratios with a known standard error, without the lowest and highest 2 %: the first ratios of a touch can
// be far from all others.
function middle(ratios, lows) {
  let kept = ratios.filter((value, i) => value !== null && lows[i] !== null);
  if (kept.length < 8) kept = ratios.filter((value) => value !== null);
  if (!kept.length) return null;
  kept.sort((a, b) => a - b);
  const low = kept[Math.floor(0.02 * (kept.length - 1))], high = kept[Math.ceil(0.98 * (kept.length - 1))];
  const margin = Math.max((high - low) * 0.15, Math.abs(high) * 0.01, 1e-6);
  return [low - margin, high + margin];
}
