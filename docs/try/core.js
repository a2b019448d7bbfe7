// The core in WebAssembly, and what it makes of a measurement: rows, and the messages of the live page's server.
// cpp/wasm/palpate.cpp says what its functions do.

import { GIVEN } from "./given.js";

export class Refused extends Error {}

// Refuses unless it holds.
export function require(holds, text) {
  if (!holds) throw new Refused(text);
}

const COLUMNS = ["t", "hard", "soft", "ratio", "error", "statistic"];
const ROW = 56; // bytes of a sample, cpp/rows/own_rows.hpp
const NUMBERS = [
  "number",
  "start",
  "start_s",
  "end_s",
  "samples",
  "ratio",
  "covariance",
  "standard_error",
  "revised",
  "first_ratio",
  "first_standard_error",
  "offset_ratio",
  "offset_standard_error",
  "offset",
  "drift",
  "lag",
  "curve",
  "tilt",
  "shift",
  "alarm_share",
  "saturated",
  "refused",
  "outliers",
  "level_ratio",
  "level_standard_error",
  "contact_exponent",
  "depth_pF",
  "rise_s",
  "age_s",
  "ratio_before",
  "before_standard_error",
  "ratio_after",
  "after_standard_error",
];

export class Core {
  static async of(compiled) {
    const core = new Core();
    const ascii = (at, size) =>
      String.fromCharCode(...new Uint8Array(core.wasm.memory.buffer, at, size));
    core.word = (at) => ascii(at, new Uint8Array(core.wasm.memory.buffer, at).indexOf(0));
    core.wasm = (
      await WebAssembly.instantiate(compiled, {
        env: { number: (at, size) => Number(ascii(at, size)) },
      })
    ).exports;
    core.wasm._initialize();
    return core;
  }

  begin({ seconds, samples, release, full_scale, host_stamps, confirmed, contact_exponent, age }) {
    this.wasm.begin(
      seconds ?? 0,
      samples ?? 0,
      release,
      full_scale,
      host_stamps,
      confirmed,
      contact_exponent,
      age,
    );
  }

  // Reads whole lines: [rows that are plain, bytes of them].
  parse(bytes) {
    new Uint8Array(this.wasm.memory.buffer).set(bytes, this.wasm.text());
    return [this.wasm.parse(bytes.length), this.wasm.parsed()];
  }

  // Gives the samples [from, to) to the tracker; yields a copy of the rows of each part.
  *take(from, to) {
    for (let at = from; at < to;) {
      const end = this.wasm.take(at, to);
      const { buffer } = this.wasm.memory;
      const block = { end, flags: new Uint8Array(buffer, this.wasm.flags(), end).slice() };
      COLUMNS.forEach(
        (name, i) => (block[name] = new Float64Array(buffer, this.wasm.column(i), end).slice()),
      );
      yield block;
      at += end;
    }
  }

  // The touches that ended, or were revised, since the last call of the core.
  // What was judged of the readings since then.
  get judgements() {
    const size = this.wasm.judgement_size();
    return Array.from({ length: this.wasm.judgement_count() }, (_, k) => {
      const [name, channel, t_s, ...sizes] = new Float64Array(
        this.wasm.memory.buffer,
        this.wasm.judgements() + 8 * size * k,
        size,
      );
      return judgementOf(JUDGED[name], CHANNELS[channel], t_s, ...sizes);
    });
  }

  get touches() {
    const size = this.wasm.touch_size();
    return Array.from({ length: this.wasm.touch_count() }, (_, k) => {
      const numbers = new Float64Array(
        this.wasm.memory.buffer,
        this.wasm.touches() + 8 * size * k,
        size,
      );
      const touch = Object.fromEntries(NUMBERS.map((name, i) => [name, orNull(numbers[i])]));
      return {
        ...touch,
        revised: touch.revised === 1,
        flags: this.word(this.wasm.touch_flags(k)).split(",").slice(0, -1),
      };
    });
  }
}

const JUDGED = ["saturated", "frozen", "jumped", "was_touch", "step", "falling", "still"];
const CHANNELS = ["hard", "soft", "both"];
const ENDS = [4.096, 8.192, 15];
const NEAR = 5e-4; // pF
const NOTHING = "nothing is connected, no excitation, or a CAPDAC that is too large";
const rounded = (value, digits) => `${Number(value.toPrecision(digits))}`;
const signed = (value) => `${value < 0 ? "" : "+"}${rounded(value, 2)}`;

// A judgement with its sentence, as palpate.Judgement has it.
function judgementOf(name, channel, t_s, size, soft) {
  const who = `the ${channel} channel`;
  const at = `${t_s.toFixed(1)} s`;
  const atEnd = ENDS.some((end) => Math.abs(Math.abs(size) - end) < NEAR);
  const texts = {
    saturated: atEnd
      ? `${who} is at the end of its range, ${rounded(size, 4)} pF, from ${at} on: ${size > 0 ? "no CAPDAC, or one that is too small" : NOTHING}`
      : `${who} stays at its highest reading, ${rounded(size, 4)} pF, while the other one moves`,
    frozen: size
      ? `${who} stands at ${rounded(size, 6)} pF to the last digit from ${at} on: a frozen program, a full range, or a stage that stopped there`
      : `${who} is exactly 0 from ${at} on: ${NOTHING}`,
    jumped:
      channel === "both"
        ? `both channels jumped, by ${signed(size)} and ${signed(soft)} pF, at ${at}`
        : `${who} jumped by ${signed(size)} pF at ${at}`,
    was_touch: "both channels fell by what they had jumped: it was a touch",
    step: `${who} stepped by ${signed(size)} pF at ${t_s.toFixed(2)} s, within a press`,
    falling:
      size > 0
        ? "both channels rise when pressed, and the option falling is set: leave it out"
        : "both channels fall when pressed: wired inversely, or mutual capacitance; option: falling",
    still: `${who} stays at ${rounded(size, 4)} pF in several presses: did the stage stop there? If not, it is at the end of its range`,
  };
  return { t_s, channel, name, text: texts[name] };
}

const orNull = (value) => (Number.isNaN(value) ? null : value);
const USELESS = 8; // of a row's flags: a reading has no value

export class Measurement {
  constructor(core, { name, device, scene, settings }) {
    Object.assign(this, {
      core,
      name,
      device,
      scene,
      settings,
      messages: [],
      gaps: [],
      marks: [],
      tares: [],
      found: [],
      judged: [],
    });
    Object.assign(this, { rows: 0, lost: 0, useless: 0, origin: null, end: null });
    this.parts = []; // rows that are not shown yet
    this.core.begin(settings);
  }

  // Gives samples that the core holds to the tracker.
  take(from, to) {
    for (const block of this.core.take(from, to)) {
      this.origin ??= block.t[0];
      this.end = block.t[block.end - 1];
      this.rows += block.end;
      for (const flags of block.flags) this.useless += (flags & USELESS) > 0;
      this.parts.push(block);
      this.note();
    }
  }

  // Of the ratio, by the converter: the data sheet's limit in both channels (Uncertainty.of).
  linearity({ ratio, covariance, samples }) {
    const linear = this.settings.full_scale === GIVEN.full_scale_pF ? GIVEN.linearity_pF : 0;
    return linear * Math.hypot(1, ratio) * Math.sqrt(covariance * samples);
  }

  note() {
    for (const touch of this.core.touches) this.found[touch.number - 1] = touch;
    this.judged.push(...this.core.judgements);
  }

  // Measures the baseline again.
  tare() {
    this.core.wasm.tare(true);
    this.note();
    this.tares.push(this.end);
  }

  // The samples that follow are not those after the ones before.
  gap() {
    this.core.wasm.gap();
    this.note();
  }

  close() {
    this.core.wasm.finish();
    this.note();
  }

  get hello() {
    const {
      file,
      origin: origin_s,
      name: source,
      device,
      scene,
      settings: { samples, seconds },
    } = this;
    return {
      kind: "file",
      file,
      origin_s,
      source,
      device,
      scene,
      samples,
      seconds,
      threshold: GIVEN.threshold,
      calibrated: false,
      scatter: null,
    };
  }

  get state() {
    const now = { word: "File", sub: this.name, tone: "idle", share: null };
    const line = { level: "quiet", title: "", text: this.file.said };
    const estimate = { ratio: null, standard_error: null, ...uncertaintyOf(null, null, 0) };
    return {
      state: "ended",
      end_s: this.end,
      ...estimate,
      now,
      line,
      announce: `File. ${line.text}`,
      messages: this.messages,
    };
  }

  get touches() {
    const rows = this.found.map((touch) => {
      const why = whyOf(touch);
      return {
        ...touch,
        ...uncertaintyOf(touch.ratio, touch.standard_error, this.linearity(touch)),
        modulus: null,
        specimen: null,
        deviation: null,
        advice: adviceOn(touch),
        kept: !why,
        why,
      };
    });
    return { rows, most_reliable: null, together: null };
  }

  get events() {
    const flags = this.found.flatMap((touch) =>
      touch.flags.map((name) => ({
        t_s: touch.end_s,
        touch: touch.number,
        name,
        text: `${name}: ${ADVICE[name]}`,
      })),
    );
    return {
      marks: this.marks,
      tares: this.tares,
      gaps: this.gaps,
      judgements: this.judged,
      flags,
    };
  }

  get session() {
    return {
      specimens: [],
      next: null,
      notes: [],
      last: null,
      count: { kept: this.found.filter((touch) => !whyOf(touch)).length, of: this.found.length },
    };
  }
}

// With the scatter from touch to touch that palpate assumes without a calibration (palpate/uncertainty.py).
const SCATTER = 0.03;
const uncertaintyOf = (ratio, error, linear) => ({
  uncertainty: error === null ? null : Math.hypot(error, linear, SCATTER * ratio),
  uncertainty_from: "assumed",
});

// What each flag means and asks for; palpate.advice says it with the numbers of the touch.
export const ADVICE = {
  short: "the touch ended before its full length: hold the probe longer",
  saturated: "readings are outside the range of the converter and left out: press less deep",
  refused: "readings gave no sample: check the cable and the connection of the board",
  late: "samples did not come in time, as the computer was too slow: close other programs",
  outliers:
    "readings of a channel are far from their neighbours and left out: a wire or a connector that fails now and then; check both ends of the cable",
  unsettled: "too few samples for a standard error: hold the probe longer",
  unexcited:
    "the change of the capacitances was too small to move the ratio from its initial value: press deeper",
  "one-sided":
    "the press did not raise both channels by amounts that can be compared: check that both gauges are wired, and to the right inputs; or press deeper",
  offset: "hard against soft misses the origin: hold the probe upright",
  drift:
    "a baseline or the object changed during the touch: hold the probe still, and keep hands and metal away from it",
  lag: "one channel is late: press slowly; check that the channels are not swapped",
  curve: "hard against soft bends: press less deep",
  tilt: "the ratio differs from the one over the swept depth, which a tilt does not change: hold the probe upright",
  changed:
    "the ratio changed, during the touch or shortly before its end: touch one object at a time, and lift straight up",
  step: "a channel jumped during the touch (a connector, the range of the converter), so the ratio is wrong: fix the cable, and touch again",
  jumped:
    "the channels jumped to new levels and stayed there without tremor: this was probably no contact, and the ratio means nothing",
  creep:
    "a channel recovers slowly after the release, so the ratio is not corrected: press for a shorter time",
  baseline:
    "it was measured in contact, and is measured again now: the ratio is wrong: touch again",
  gap: "the board restarted or was opened again during the touch or before it, so the baseline may have been measured in contact: lift the probe, and touch again",
};
const SWAPPED =
  "swapped: the soft channel changed more than the hard one: exchange the wires of the two inputs";
const FEWEST = 16; // samples of a short touch that counts

function adviceOn(touch) {
  const { ratio, standard_error: error, samples, flags } = touch;
  const least = 1 - (error === null ? 0.2 : 2 * error);
  const swapped =
    samples >= 20 &&
    ratio > 0 &&
    ratio < least &&
    !["unexcited", "one-sided", "baseline"].some((flag) => flags.includes(flag));
  return [...flags.map((flag) => `${flag}: ${ADVICE[flag]}`), ...(swapped ? [SWAPPED] : [])];
}

// Why a touch does not count, as palpate.repeatability says; "": it does.
function whyOf({
  flags,
  samples,
  refused,
  saturated,
  outliers,
  standard_error: error,
  revised,
  age_s: age,
  offset,
  drift,
  curve,
  shift,
}) {
  // An error of less than a third of the scatter from touch to touch excludes nothing.
  const small = (share) => share !== null && Math.abs(share) < 0.03 / 3;
  const harmless = {
    short: error !== null && samples >= FEWEST && !age,
    drift: small(drift) || (error !== null && (revised || age > 0)),
    creep: age > 0 || small(shift),
    offset: small(offset),
    curve: small(curve),
    late: error !== null && samples >= FEWEST,
    outliers: 8 * outliers <= samples + refused + saturated,
    tilt: true,
    changed: true,
  };
  const found = flags.find((flag) => !harmless[flag]);
  return found ? `${found}: ${ADVICE[found]}` : "";
}
