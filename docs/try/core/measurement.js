// What is known of a measurement, in the words of the live page's server: hello, state, touches, events, session.

import { advice, calm, gap, left_out, objections, retaken, swapped, TABLES } from "./tables.js";
import { FIELDS } from "./module.js";
import { plusMinus } from "./page/formatting.js";

const RULES = { gap, retaken, swapped, left_out };
const STATES = { baseline: "baseline", waiting: "no contact", done: "done" };
const PRESSED = ["contact", "adapting", "done"];
const TOLD_S = 10; // what happened is told for so long

export class Measurement {
  constructor(module, { kind, name, device = "", scene = "handheld", settings }) {
    Object.assign(this, { module, kind, name, device, scene, settings, truth: null, error: "", ended: false });
    module.begin(settings);
    this.last = this.measuring = null;
    this.found = [];
    this.marks = [];
    this.tares = [];
    this.gaps = [];
    this.notes = [];
    this.said = [];
    this.lost = this.useless = this.limited = this.rows = this.retakenBefore = 0;
    this.origin = this.end = this.gapAt = this.retakenAt = this.contactAt = this.doneAt = null;
    this.news = false;
    this.block = blockOf(0);
    this.file = null;
    this.utc = null;
  }

  // Takes rows of the module; returns a copy of them.
  add(block, touches) {
    const { end } = block, copy = blockOf(end);
    for (const name of [...FIELDS, "flags"]) copy[name].set(block[name]);
    if (end) {
      this.origin ??= block.t[0];
      this.end = block.t[end - 1];
      this.rows += end;
    }
    for (let i = 0; i < end; i++) {
      if (block.flags[i] & 8) this.useless += 1;
      if (block.flags[i] & 16) this.limited += 1;
    }
    this.follow(copy);
    this.note(touches);
    return copy;
  }

  // Gives samples to the tracker, and returns their rows.
  feed(samples) {
    const { module } = this, parts = [];
    for (let at = 0; at < samples.length; at += module.most) {
      const some = samples.slice(at, at + module.most);
      some.forEach((sample, i) => module.row(i).set(sample));
      module.take(0, some.length, (block, touches) => parts.push(this.add(block, touches)));
    }
    return (this.block = joined(parts));
  }

  // Measures the baseline again; false: the probe is in contact.
  tare() {
    if (!this.module.wasm.tare(false)) return false;
    this.note(this.module.touches());
    this.tares.push(this.end);
    return (this.news = true);
  }

  // No more rows come.
  close(text = "") {
    if (!this.ended) this.note(this.module.wasm.finish() ? this.module.touches() : []);
    [this.ended, this.error] = [true, text];
    return (this.block = blockOf(0));
  }

  note(touches) {
    for (const touch of touches) {
      this.found[touch.number - 1] = touch;
      this.news = true;
    }
  }

  // When contact, touch and its completion began.
  follow(block) {
    const { wasm } = this.module;
    if (wasm.retaken() > this.retakenBefore) [this.retakenBefore, this.retakenAt] = [wasm.retaken(), this.end];
    for (let i = 0; i < block.end; i++) {
      const on = block.flags[i] & 2;
      if (on && this.measuring === null) this.measuring = block.t[i];
      if (!on) this.measuring = null;
    }
    const state = this.raw;
    this.contactAt = PRESSED.includes(state) ? this.contactAt ?? this.end : null;
    this.doneAt = state === "done" ? this.doneAt ?? this.end : null;
  }

  cut(from_s, to_s, lost, text) {
    this.gaps.push({ from_s, to_s, lost, text });
    this.gapAt = this.end;
    this.news = true;
  }

  get raw() {
    return this.ended ? "ended" : this.module.state;
  }

  get shown() {
    if (this.raw !== "contact") return STATES[this.raw] ?? this.raw;
    return this.module.wasm.alarm() || Number.isNaN(this.module.wasm.standard_error()) ? "adapting" : "contact";
  }

  get hello() {
    const { seconds, samples, threshold } = this.settings;
    return {
      type: "hello", measurement: 1, kind: this.kind, file: this.file, version: TABLES.version, origin_s: this.origin, utc: this.utc, samples, seconds,
      source: this.name, device: this.device, scene: this.scene, threshold, statistic_unit: "", calibrated: false, scatter: null,
    };
  }

  get state() {
    const measured = ["contact", "done"].includes(this.raw), { wasm } = this.module, error = measured ? orNull(wasm.standard_error()) : null;
    const counters = { read: this.rows, lost: this.lost, delivered: this.rows, refused: this.useless, saturated: this.limited, retaken: wasm.retaken() };
    const [now, line] = this.ended ? this.closed() : this.view();
    const told = { what: line.what, level: line.level, title: line.title, text: line.text, since_s: null };
    return {
      type: "state", state: this.shown, end_s: this.end, ratio: measured ? wasm.ratio() : null, standard_error: error, uncertainty: error, modulus: null,
      pairs_per_s: this.rows > 1 ? (this.rows - 1) / (this.end - this.origin) : null, counters, messages: [...this.notes, ...this.said], error: this.error,
      now, line: told, announce: `${now.word}. ${line.title} ${line.said || line.text}`, recording: null, proposed: "", files: [],
    };
  }

  // What to do and what is wrong, by the rules of the live page, as far as they are about touches.
  view() {
    const facts = this.facts();
    const [now, line] = calm(facts), urgent = TABLES.urgent.map((name) => RULES[name](facts)).find(Boolean);
    return urgent ? [urgent.now ?? now, urgent.line] : [now, line];
  }

  facts() {
    const since = (at) => (at === null ? Infinity : this.end - at), last = this.found.at(-1), { seconds } = this.settings;
    const passed = this.measuring === null ? NaN : this.end - this.measuring, state = this.shown;
    const timed = state !== "done" && seconds && passed >= 0;
    const result = last && {
      number: last.number, why: whyOf(last), flags: objections(last), revised: last.revised,
      text: plusMinus(last.ratio, last.standard_error).join(" ").trim(), swapped: advice(last).find((told) => told.startsWith("swapped")) ?? "",
    };
    return {
      state, result, next: null, about: "", lost: this.gaps.at(-1)?.lost ?? 0, gap: this.gaps.at(-1)?.text ?? "", cut_text: "", pressed: PRESSED.includes(state),
      gap_s: state === "baseline" || since(this.gapAt) < TOLD_S ? since(this.gapAt) : Infinity,
      retaken_s: since(this.retakenAt) < TOLD_S ? since(this.retakenAt) : Infinity,
      seen: {
        noise_pF: [NaN, NaN], contact_s: this.contactAt === null ? NaN : this.end - this.contactAt, done_s: this.doneAt === null ? NaN : this.end - this.doneAt,
        share: state === "done" ? 1 : timed ? Math.min(passed / seconds, 1) : null, left_s: timed ? Math.max(seconds - passed, 0) : NaN,
      },
    };
  }

  closed() {
    const what = this.file ? `A recording: ${this.file.end}, ${this.file.rows} rows, ${this.file.missing} missing. Nothing is being measured.` : this.error;
    const title = TABLES.damaged[this.file?.end] ?? "", level = this.error ? "fault" : title ? "caution" : "quiet";
    return [{ word: this.file ? "File" : "Stop", sub: this.name, tone: "idle", share: null }, { what: "file", level, title, text: what }];
  }

  get touches() {
    this.news = false;
    const rows = this.found.map((touch) => {
      const { revised, flags, effects, ...numbers } = touch, why = whyOf(touch);
      return {
        ...plain(numbers), revised, flags, effects: plain(effects), uncertainty: orNull(touch.standard_error), modulus: null, advice: advice(touch),
        specimen: null, deviation: null, kept: !why, why,
      };
    });
    return { type: "touches", rows, most_reliable: null, together: null };
  }

  get events() {
    const flags = this.found.flatMap((touch) => {
      const told = advice(touch);
      return touch.flags.map((name, i) => ({ t_s: touch.end_s, touch: touch.number, name, text: told[i] }));
    });
    return { type: "events", marks: this.marks, tares: this.tares, gaps: this.gaps, flags };
  }

  get session() {
    const kept = this.found.filter((touch) => !whyOf(touch)).length, last = this.found.at(-1);
    return {
      type: "session", title: "", operator: "", wanted: 0, specimens: [], next: null, count: { kept, of: this.found.length }, notes: [],
      last: last ? { touch: last.number, kept: !whyOf(last) } : null,
    };
  }
}

export function blockOf(size) {
  const block = { first: 0, end: size, bin: 0, flags: new Uint8Array(size) };
  for (const name of FIELDS) block[name] = new Float64Array(size);
  return block;
}

export function joined(parts) {
  const all = blockOf(parts.reduce((sum, { end }) => sum + end, 0));
  let at = 0;
  for (const part of parts) {
    for (const name of [...FIELDS, "flags"]) all[name].set(part[name], at);
    at += part.end;
  }
  return all;
}

// Why a touch does not count; "" if it does.
function whyOf(touch) {
  const flags = objections(touch);
  return advice(touch).find((told) => flags.includes(told.split(":")[0])) ?? "";
}

const orNull = (value) => (Number.isNaN(value) ? null : value);
const plain = (numbers) => Object.fromEntries(Object.entries(numbers).map(([name, value]) => [name, orNull(value)]));
