// Calibration: ratio against modulus with eq. (2), and below it the distance of each touch from it, on one logarithmic axis.

import { inUnit, number, settings, signed } from "../formatting.js";
import { decades, placed, stepOf, ticks } from "./axes.js";
import { unit } from "./canvas.js";
import { SvgChart, area, clipped, dot, label, line, measure, ruler, valueAxis } from "./svg.js";

const NEAR = 12; // pixels

export class FitPlot extends SvgChart {
  dots = [];

  draw() {
    const [width, height] = this.size;
    const { calibration } = this.charts.known;
    this.dots = [];
    if (width < 120 || height < 120 || !calibration.points) return;
    const points = calibration.points.filter(({ modulus, ratio }) => modulus > 0 && ratio > 0);
    if (!points.length) return this.write("No touch of a specimen with a known modulus yet.");
    const shown = this.layout(width, height, points, calibration);
    this.show(this.axes(shown) + this.curve(shown) + this.touches(shown), this.name(shown));
  }

  layout(width, height, points, { curve, rigid }) {
    const k = unit();
    const left = 44 * k;
    const right = width - 8;
    const split = Math.round(0.62 * height);
    const foot = height - 36 * k;
    const top = 10 * k;
    const low = split + 18 * k;
    const moduli = [...(curve?.modulus ?? []), ...points.map(({ modulus }) => modulus)];
    const e = [Math.min(...moduli), Math.max(...moduli)].map(Math.log10);
    const pad = 0.04 * Math.max(0.5, e[1] - e[0]);
    const from = e[0] - pad;
    const to = e[1] + pad;
    const highest =
      1.04 *
      Math.max(...points.map(({ ratio }) => ratio), ...(curve?.ratio ?? []), rigid?.value ?? 0);
    const lowest = Math.min(1, ...points.map(({ ratio }) => ratio));
    const away = points.map((point) =>
      point.fitted ? 100 * (point.ratio / point.fitted - 1) : null,
    );
    const reach = Math.max(2, 1.15 * Math.max(0, ...away.map((d) => Math.abs(d ?? 0))));
    const x = (modulus) => left + ((Math.log10(modulus) - from) / (to - from)) * (right - left);
    const y = (ratio) => split - ((ratio - lowest) / (highest - lowest)) * (split - top);
    const z = (d) => (low + foot) / 2 - (d / reach) * ((foot - low) / 2);
    return {
      k,
      left,
      right,
      split,
      foot,
      top,
      low,
      from,
      to,
      lowest,
      highest,
      reach,
      x,
      y,
      z,
      points,
      away,
      curve,
      rigid,
    };
  }

  axes({ k, left, right, split, foot, top, low, from, to, lowest, highest, reach, x, y, z }) {
    const parts = decades(from, to, [1, 3]).map(
      (modulus) =>
        ruler(x(modulus), top, x(modulus), foot, "grid") +
        label(x(modulus), foot + 15 * k, inUnit(Number(modulus.toPrecision(1))), "", "middle"),
    );
    const edges = { k, left, right };
    const ratios = ticks(lowest, highest, stepOf(highest - lowest, (split - top) / (30 * k)));
    parts.push(valueAxis(ratios, edges, y, (ratio) => Number(ratio.toPrecision(4))));
    const step = stepOf(2 * reach, Math.max(4, (foot - low) / (22 * k)));
    const percents = ticks(-reach, reach, step);
    const percentText = (d) => signed(d, step < 1 ? 1 : 0);
    parts.push(valueAxis(percents, edges, z, percentText, (d) => d === 0));
    const both = "above: ratio · below: distance from the curve, %";
    const axis = `modulus, ${settings.unit}`;
    const room = measure(both, k) + measure(axis, k) + 10 < right - left;
    parts.push(
      label(right, foot + 31 * k, axis, "", "end") +
        label(left, foot + 31 * k, room ? both : "below: distance, %"),
    );
    return parts.join("");
  }

  curve({ k, left, right, split, top, low, foot, x, y, z, curve, rigid }) {
    const parts = [];
    if (curve?.modulus.length) {
      const { modulus, ratio, low: under, high } = curve;
      const upper = (value, i) => 100 * (value / ratio[i] - 1);
      const points = (values) => modulus.map((one, i) => [x(one), y(values[i])]);
      const spread = (values) => modulus.map((one, i) => [x(one), z(upper(values[i], i))]);
      parts.push(
        clipped(
          left,
          top,
          right - left,
          split - top,
          area(points(high), points(under), "fband") + line(points(ratio), "ratio"),
        ),
      );
      parts.push(
        clipped(left, low, right - left, foot - low, area(spread(high), spread(under), "fband")),
      );
    }
    if (rigid)
      parts.push(
        ruler(left, y(rigid.value), right, y(rigid.value), "quiet", { dash: "5 4" }) +
          label(
            left + 4,
            y(rigid.value) + 14 * k,
            `rigid object: ${number(rigid.value, rigid.error)}${rigid.error ? ` ± ${number(rigid.error, rigid.error)} (k = 1)` : ""}`,
          ),
      );
    return parts.join("");
  }

  touches({ k, points, away, left, right, split, x, y, z }) {
    const newest = Math.max(...points.map(({ touch }) => touch));
    const drawn = points.map((point, i) => {
      const places = [y(point.ratio), ...(away[i] === null ? [] : [z(away[i])])];
      const px = x(point.modulus);
      const now = point.touch === newest;
      places.forEach((py) => this.dots.push({ x: px, y: py, point, away: away[i] }));
      return places
        .map((py) =>
          point.kept
            ? dot(px, py, (now ? 5 : 2.8) * k, now, "hard", `touch ${point.touch}`)
            : label(px, py + 4 * k, "×", "leftout", "middle"),
        )
        .join("");
    });
    const specimens = [
      ...new Map(points.map(({ specimen, modulus }) => [specimen, modulus])),
    ].filter(([name]) => name);
    const wanted = specimens.map(([text, modulus]) => ({
      text,
      width: measure(text, k),
      height: 13 * k,
      places: [
        [
          Math.min(right - measure(text, k), Math.max(left, x(modulus) - measure(text, k) / 2)),
          split + 9 * k,
        ],
      ],
    }));
    this.labels = placed(wanted, { left, right, top: split, bottom: split + 18 * k });
    return (
      drawn.join("") +
      this.labels.map(({ x: px, y: py, text }) => label(px, py + 4 * k, text)).join("")
    );
  }

  name({ points, away }) {
    const kept = points.filter(({ kept: is }) => is);
    const most = Math.max(0, ...away.filter((d, i) => d !== null && points[i].kept).map(Math.abs));
    return `Calibration: ratio against modulus, and the distance from the curve. ${kept.length} touches kept, ${points.length - kept.length} left out, at most ${most.toFixed(1)} % from the curve`;
  }

  at(px, py) {
    const found = this.dots
      .map((dot) => ({ ...dot, far: Math.hypot(dot.x - px, dot.y - py) }))
      .sort((a, b) => a.far - b.far)[0];
    if (!(found?.far <= NEAR)) return null;
    const { touch, specimen, modulus, ratio, kept } = found.point;
    const away = found.away === null ? "" : `${signed(found.away, 1)} % from the curve`;
    return {
      x: found.x,
      lines: [
        `touch ${touch}, ${specimen ?? ""}`,
        inUnit(`${number(modulus)} MPa`),
        `ratio ${number(ratio)}`,
        away,
        kept ? "" : "left out",
      ].filter(Boolean),
    };
  }
}
