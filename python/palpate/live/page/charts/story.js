// One touch. In Explain from before the contact until after the release: both channels, below them the estimate with its noise,
// below that the detector, on one axis of time; a numbered pin where a flag arises. In the Lab without the channels, which are in
// its timeline, and with the touches before on the same specimen.

import { fill, make, put } from "../dom.js";
import { number, signed } from "../formatting.js";
import { samplesIn } from "./annotations.js";
import { placesOf, stepOf, ticks, timeStep } from "./axes.js";
import { unit } from "./canvas.js";
import { cutMarks, detectorStrip, estimateCurve, percentAxis, percentages } from "./estimate.js";
import { nearest } from "./plot.js";
import { SvgChart, box, clipped, label, line, measure, ruler, valueAxis } from "./svg.js";

const TITLE = 18; // units of height
const SHARES = [0.46, 0.36, 0.18]; // of the height: channels, estimate, detector
const LAB_SHARES = [0, 0.78, 0.22];
const FINGER = 44; // px: a pin that is tapped
const PIN = 24; // units: a pin that is clicked
// Titles, the longest first: the one that has room is written.
const ESTIMATE = [
  "Estimate of the ratio; band: noise (k = 1)",
  "Ratio; band: noise (k = 1)",
  "Ratio",
];
const DETECTOR = [
  "Detector (CUSUM); above the dashed line: changed",
  "Detector (CUSUM)",
  "Detector",
];

export function titleOf({ number: n, specimen, running }) {
  return [`Touch ${n}`, specimen, running ? "running" : ""].filter(Boolean).join(" · ");
}

function panelTitle(texts, left, right, top, k) {
  const text = texts.find((one) => measure(one, k) <= right - left) ?? texts.at(-1);
  return label(left, top - 5 * k, text, "value");
}

export class StoryPlot extends SvgChart {
  // lab: as the Lab shows it
  constructor(place, charts, lab = false) {
    super(place, charts);
    this.lab = lab;
    this.pins = place.appendChild(make("div", { className: "pins" }));
  }

  draw() {
    const [width, height] = this.size;
    this.shown = null;
    if (width < 60 || height < 80) return;
    const story = this.lab ? this.charts.labStory() : this.charts.story();
    if (this.lab) put("touchtitle", story ? titleOf(story.touch) : "Touch");
    if (!story?.block) {
      this.pins.replaceChildren();
      this.pins.filled = null;
      this.write(
        story
          ? "The readings of this touch are on their way."
          : "No touch yet. Press the probe on an object, and hold it.",
      );
      return;
    }
    const shown = { ...story, ...this.layout(width, height, story) };
    this.shown = shown;
    const ground = this.contact(shown) + this.time(shown);
    const channels = this.lab ? "" : this.channels(shown);
    const panels = channels + this.estimate(shown) + this.detector(shown);
    this.show(ground + panels + this.pinLines(shown), this.name(shown));
    this.placePins(shown);
  }

  layout(width, height, { touch, from, to, pins }) {
    const k = unit();
    const left = 58 * k;
    const right = width - (this.lab ? 84 : 14) * k;
    const finger = matchMedia("(max-width: 1099px), (max-height: 699px)").matches;
    const pin = finger ? FINGER : PIN * k;
    const head = pins.length ? pin + 4 : 2;
    const room = height - head - 20 * k;
    const panels = [];
    let top = head;
    for (const share of this.lab ? LAB_SHARES : SHARES) {
      panels.push({ top: top + (this.lab ? 6 : TITLE * k), foot: top + share * room });
      top += share * room;
    }
    const x = (t) => left + ((t - from) / (to - from)) * (right - left);
    return { k, left, right, width, height, pin, head, panels, foot: top, x, start: touch.start_s };
  }

  // The time of contact as an area, from the first to the last sample of the touch.
  contact({ touch, x, left, right, head, foot }) {
    const begin = Math.max(left, x(touch.start_s));
    const end = Math.min(right, x(touch.end_s));
    return box(begin, head, Math.max(1, end - begin), foot - head, "fband");
  }

  pinLines({ pins, x, left, right, head, foot }) {
    const lines = pins.map(({ t_s, bad }) => {
      const at = Math.max(left, Math.min(right, x(t_s)));
      return ruler(at, head, at, foot, bad ? "bad" : "quiet", { dash: "2 3" });
    });
    return lines.join("");
  }

  channels({ k, block, from, to, left, right, x, panels: [panel] }) {
    const curves = {
      soft: samplesIn(block, "soft", from, to),
      hard: samplesIn(block, "hard", from, to),
    };
    const values = [...curves.hard, ...curves.soft].flat().map(([, value]) => value);
    const high = Math.max(1e-6, ...values);
    const low = Math.min(0, ...values);
    const pad = 0.06 * (high - low);
    const { top, foot } = panel;
    const y = (value) => foot - ((value - low + pad) / (high - low + 2 * pad)) * (foot - top);
    const step = stepOf(high - low, Math.max(2, (foot - top) / (34 * k)));
    const textOf = (value) => {
      const text = step < 1e-4 ? value.toExponential(0) : value.toFixed(placesOf(step));
      return text.replace("-", "−");
    };
    const isZero = (value) => Math.abs(value) < step / 2;
    const axis = valueAxis(ticks(low, high, step), { k, left, right }, y, textOf, isZero);
    const drawn = Object.entries(curves).flatMap(([name, pieces]) =>
      pieces.map((points) => {
        const path = points.map(([t, value]) => [x(t), y(value)]);
        return line(path, name, name === "hard" ? 2.2 : 1.6);
      }),
    );
    const title = panelTitle(
      ["Capacitance change, pF", "Change, pF"],
      left,
      right - 120 * k,
      top,
      k,
    );
    const key =
      label(right, top - 5 * k, "hard ━", "hardkey", "end") +
      label(right - 60 * k, top - 5 * k, "soft ━", "softkey", "end");
    return axis + clipped(left, top, right - left, foot - top, drawn.join("")) + title + key;
  }

  estimate(shown) {
    const { k, touch, curve, left, right, panels } = shown;
    const { top, foot } = panels[1];
    const title = this.lab ? "" : panelTitle(ESTIMATE, left, right, top, k);
    if (curve.length < 2 || !Number.isFinite(touch.ratio) || touch.ratio === 0) {
      return title + label(left + 8, (top + foot) / 2, "No estimate of the ratio.");
    }
    const known = percentages(shown);
    const y = percentAxis(known.scale, top, foot);
    const x = (t) => shown.x(t + shown.start);
    const span = (Math.abs(known.zero) * known.scale) / 100;
    const step = stepOf(2 * span, Math.max(2, (foot - top) / (30 * k)));
    const ratios = ticks(known.zero - span, known.zero + span, step);
    const at = (ratio) => y(known.deviation({ ratio }));
    const textOf = (ratio) => ratio.toFixed(placesOf(step)).replace("-", "−");
    const own = { ...shown, ...known, x, y, top, base: foot };
    this.shown.scale = known.scale;
    const curves = this.earlier(own) + estimateCurve(own);
    return (
      valueAxis(ratios, shown, at, textOf) +
      ruler(left, y(0), right, y(0), "past") +
      clipped(left, top, right - left, foot - top, curves) +
      cutMarks(own) +
      this.resultBar(own) +
      title
    );
  }

  // The touches before on the same specimen, each from its own result.
  earlier({ earlier = [], x, y }) {
    const curves = earlier.map((one) => {
      const result = one.at(-1).ratio;
      const points = one.map(({ t, ratio }) => [x(t), y(100 * (ratio / result - 1))]);
      return line(points, "past", 1.1);
    });
    return curves.join("");
  }

  // The result with its whole uncertainty, after the touch; an arrow at each end if it is longer than the scale.
  resultBar({ touch, zero, scale, x, y, start, k, top, base, width }) {
    if (!touch.uncertainty || touch.running) return "";
    const percent = Math.abs((100 * touch.uncertainty) / zero);
    const at = x(touch.end_s - start) + 9 * k;
    const ends = [Math.max(top, y(percent)), Math.min(base, y(-percent))];
    const parts = [ruler(at, ends[0], at, ends[1], "ink", { width: 2 })];
    const texts = [number(touch.ratio, touch.uncertainty), `± ${number(percent, percent)} %`];
    const room = Math.max(...texts.map((text) => measure(text, k)));
    if (at + 7 * k + room <= width) {
      parts.push(label(at + 7 * k, y(0) - 5 * k, texts[0], "value"));
      parts.push(label(at + 7 * k, y(0) + 14 * k, texts[1]));
    }
    if (percent > scale) {
      parts.push(label(at, top + 9 * k, "▲", "", "middle"), label(at, base, "▼", "", "middle"));
    }
    return parts.join("");
  }

  detector(shown) {
    const { k, curve, left, right, panels } = shown;
    const { top, foot } = panels[2];
    const { threshold } = this.charts.known.hello;
    const x = (t) => shown.x(t + shown.start);
    const title = this.lab ? "" : panelTitle(DETECTOR, left, right, top, k);
    return detectorStrip({ ...shown, curve, threshold, x, foot, strip: foot - top }) + title;
  }

  time({ k, from, to, start, left, right, height, head, foot, x }) {
    const step = timeStep(to - from, (right - left) / (54 * k));
    return ticks(from - start, to - start, step)
      .map((t) => {
        const at = x(t + start);
        const text = `${t ? signed(t, placesOf(step)).replace("+", "") : "0"} s`;
        return (
          ruler(at, head, at, foot, "grid") +
          label(Math.min(at, right - 8 * k), height - 5 * k, text, "", "middle")
        );
      })
      .join("");
  }

  // Pins are buttons over the chart, in a row above it, each as near to its time as the others leave room.
  placePins({ pins, x, left, right, pin }) {
    const wanted = pins.map(({ t_s }) => Math.max(left, Math.min(right, x(t_s))) - pin / 2);
    const most = right + 14 - pin;
    for (let i = 1; i < wanted.length; i++) wanted[i] = Math.max(wanted[i], wanted[i - 1] + pin);
    let limit = most;
    for (let i = wanted.length - 1; i >= 0; i--) {
      wanted[i] = Math.max(0, Math.min(wanted[i], limit));
      limit = wanted[i] - pin;
    }
    const places = wanted.map(Math.round);
    fill(this.pins, [pins, places, pin], () =>
      pins.map(({ text, bad }, i) => {
        const button = make("button", { type: "button", title: text });
        button.ariaLabel = `${i + 1}: ${text}`;
        button.className = bad ? "pin bad" : "pin";
        button.dataset.pin = i;
        button.style.left = `${places[i]}px`;
        button.style.width = `${pin}px`;
        button.append(make("b", { textContent: i + 1 }));
        return button;
      }),
    );
  }

  name({ touch, curve, pins }) {
    const result = touch.running ? "running" : `ratio ${number(touch.ratio, touch.uncertainty)}`;
    const flags = pins.length ? `; ${pins.length} pins, in the list` : "";
    const seconds = curve.length ? `, ${curve.at(-1).t.toFixed(1)} s` : "";
    return `${titleOf(touch)}: ${this.lab ? "" : "both channels, "}estimate and detector; ${result}${seconds}${flags}`;
  }

  at(px) {
    if (!this.shown || px < this.shown.left || px > this.shown.right) return null;
    const { block, from, to, left, right, start, x } = this.shown;
    const t = from + ((px - left) / (right - left)) * (to - from);
    const row = nearest(block, t);
    if (row < 0) return null;
    const value = (name) => (Number.isFinite(block[name][row]) ? block[name][row] : null);
    const lines = [`${(block.t[row] - start).toFixed(2)} s`];
    for (const name of ["hard", "soft"]) {
      lines.push(`${name} ${value(name) === null ? "–" : value(name).toFixed(4)} pF`);
    }
    if (value("ratio") !== null) lines.push(`ratio ${number(value("ratio"), value("error"))}`);
    if (value("statistic") !== null) lines.push(`CUSUM ${number(value("statistic"))}`);
    return { x: x(block.t[row]), lines };
  }
}
