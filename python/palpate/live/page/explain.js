// Explain: one touch as a story. Beside its chart: what was noticed, by numbered pins, and its numbers in the words of the docs.

import { extremes } from "./charts/plot.js";
import { titleOf } from "./charts/story.js";
import { $, fill, make, put } from "./dom.js";
import { modulusOf, number, plusMinus, scatterWords } from "./formatting.js";
import { MEASURED, indexOf } from "./store.js";

const EDGE_S = 0.3; // the contact begins a little before its first sample
const FEWEST = 16; // idle readings, for their noise
const PER_PF = 1e6; // aF

export class Explain {
  // charts: Charts
  constructor(charts) {
    this.charts = charts;
    this.lit = null; // number of the pin that stands out
    $("storybefore").onclick = () => charts.step(-1);
    $("storyafter").onclick = () => charts.step(1);
    for (const type of ["pointerover", "focusin", "click"]) {
      $("explain").addEventListener(type, ({ target }) => this.light(target.closest("[data-pin]")));
    }
  }

  update() {
    if ($("explain").hidden) return;
    const story = this.charts.story();
    $("storybefore").disabled = !this.charts.neighbour(-1);
    $("storyafter").disabled = !this.charts.neighbour(1);
    put("storytitle", story ? titleOf(story.touch) : "No touch yet");
    put("storyresult", story ? resultOf(story.touch) : "");
    this.showPins(story);
    const facts = story?.block ? factsOf(story, this.charts.known) : [];
    fill($("storyfacts"), facts, () =>
      facts.flatMap(([name, text]) => [
        make("dt", { textContent: name }),
        make("dd", { textContent: text }),
      ]),
    );
  }

  showPins(story) {
    const pins = story?.pins ?? [];
    const sofar = story?.touch.running ? " so far" : "";
    put("pinshead", pins.length ? "What was noticed" : `Nothing was noticed${sofar}`);
    fill($("pins"), pins, () =>
      pins.map(({ text, bad }, i) => {
        const [name, ...words] = text.split(": ");
        const sentence = words.join(": ");
        const parts = sentence ? [make("b", { textContent: name }), `: ${sentence}`] : [name];
        const button = make("button", { type: "button", className: bad ? "bad" : "" }, ...parts);
        button.dataset.pin = i;
        return make("li", {}, button);
      }),
    );
  }

  // A pin and its sentence stand out together.
  light(element) {
    if (!element) return;
    for (const one of document.querySelectorAll("#explain [data-pin]")) {
      one.ariaCurrent = String(one.dataset.pin === element.dataset.pin);
    }
  }
}

// The result as it is everywhere: with its whole uncertainty, or the modulus with its interval.
function resultOf(touch) {
  if (touch.running) return "";
  if (!Number.isFinite(touch.ratio)) return "no ratio";
  const { value, unit, interval } = modulusOf(touch.modulus);
  const ratio = `ratio ${plusMinus(touch.ratio, touch.uncertainty).join(" ")}`.trim();
  const modulus = unit ? `${value} ${unit} (${interval}, 95 %), ` : "";
  return `${touch.kept ? "" : "left out: "}${modulus}${ratio}`;
}

// [name, text]: what the pipeline did with this touch.
function factsOf({ touch, block, curve, from }, { hello, events }) {
  const facts = [
    ["Channels", channelWords(touch, block)],
    ["Baseline", baselineWords(touch, block, from, events)],
  ];
  const noise = noiseWords(touch, curve);
  if (noise) facts.push(["Noise of the estimate", noise]);
  if (!touch.running && touch.uncertainty) facts.push(["Uncertainty", uncertaintyWords(touch)]);
  if (hello.threshold) facts.push(["Detector", detectorWords(touch, curve, hello.threshold)]);
  facts.push(["Samples", sampleWords(touch, curve)]);
  return facts;
}

function channelWords({ start_s, end_s }, block) {
  const rows = [indexOf(block, start_s), indexOf(block, end_s)];
  const words = ["hard", "soft"].map((name) => {
    const [, highest] = extremes(block, [name], rows);
    return `${name} to ${number(highest)} pF`;
  });
  return `${words.join(", ")}. The ratio is hard by soft.`;
}

// Zero of both channels, with the noise of the readings that were idle before the contact.
function baselineWords({ start_s }, block, from, { tares }) {
  const noises = ["hard", "soft"].map((name) => idleNoise(block, name, from, start_s - EDGE_S));
  const tare = tares.findLast((t) => t <= start_s);
  const parts = ["the level of both channels before the contact"];
  if (tare !== undefined)
    parts.push(`the last tare was ${(start_s - tare).toFixed(0)} s before it`);
  if (!noises.includes(null)) {
    const [hard, soft] = noises.map((value) => (PER_PF * value).toFixed(0));
    parts.push(`noise of the idle readings: hard ${hard} aF, soft ${soft} aF`);
  }
  return `${parts.join("; ")}.`;
}

// Standard deviation of a channel in [from, to] where nothing is touched, pF; null: there are too few readings.
function idleNoise(block, name, from, to) {
  const values = [];
  for (let k = indexOf(block, from); k < indexOf(block, to); k++) {
    const value = block[name][k];
    if (!(block.flags[k] & MEASURED) && Number.isFinite(value)) values.push(value);
  }
  if (values.length < FEWEST) return null;
  const mean = values.reduce((sum, value) => sum + value, 0) / values.length;
  const squares = values.reduce((sum, value) => sum + (value - mean) ** 2, 0);
  return Math.sqrt(squares / (values.length - 1));
}

function noiseWords(touch, curve) {
  const error = touch.running ? curve.at(-1)?.error : touch.standard_error;
  if (!Number.isFinite(error) || !touch.ratio) return "";
  const percent = Math.abs((100 * error) / touch.ratio);
  return `${number(error, error)} (k = 1), ${number(percent, percent)} % of the ratio: how far the readings of this touch scatter.`;
}

function uncertaintyWords({ ratio, uncertainty, uncertainty_from: source }) {
  const percent = Math.abs((100 * uncertainty) / ratio);
  const size = `${number(uncertainty, uncertainty)} (k = 1), ${number(percent, percent)} %`;
  const scatter = scatterWords(source);
  return `${size}: the noise and the scatter from touch to touch together${scatter ? `; ${scatter}` : ""}.`;
}

function detectorWords({ running, alarm_share: share }, curve, threshold) {
  const known = curve.filter(({ statistic }) => Number.isFinite(statistic));
  if (!known.length) return "no value yet.";
  const peak = known.reduce((a, b) => (b.statistic > a.statistic ? b : a));
  const words = `CUSUM at most ${number(peak.statistic)} at ${peak.t.toFixed(1)} s; a change is found above ${threshold}`;
  if (peak.statistic <= threshold)
    return `${words}: the ratio did not change${running ? " so far" : ""}.`;
  const percent = share ? `, in ${number(100 * share)} % of the samples` : "";
  return `${words}: the ratio changed${percent}, and the estimate began again from the newest samples.`;
}

function sampleWords(touch, curve) {
  const seconds = touch.end_s - touch.start_s;
  const count = touch.running ? curve.length : touch.samples;
  const words = [`${count} pairs in ${seconds.toFixed(1)} s`];
  for (const [name, text] of [
    ["outliers", "left out as outliers"],
    ["saturated", "left out as saturated"],
    ["refused", "without a value"],
  ]) {
    if (touch[name]) words.push(`${text}: ${touch[name]}`);
  }
  return `${words.join(", ")}.`;
}
