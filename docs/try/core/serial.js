// A serial port: pieces of bytes as they come, to lines, to samples, to the tracker.

import { Measurement, joined } from "./measurement.js";
import { Format, sampleOf } from "./lines.js";
import { Refused, quoted } from "./refused.js";
import { TABLES } from "./tables.js";

const { serial: KNOWN } = TABLES;
const LONGEST = 1000; // bytes of a line
const STRANGE = 20, PATIENCE_S = 10; // lines that are not read, and how long, before that is an error
const SHOWN = 20, KEPT = 100; // comments of the board; messages
const NO_VALUE_S = 5;

export class Serial extends Measurement {
  constructor(module, name) {
    super(module, { kind: "live", name, device: "serial port", settings: settingsOf(null) });
    Object.assign(this, { rest: "", whole: false, format: null, clock: new Clock(), strange: 0, since: 0, errors: 0, begun: null, valued: null });
  }

  // Takes what came from the port, and when, s; returns the new rows.
  take(chunk, at_s) {
    this.begun ??= at_s;
    const now = at_s - this.begun, text = this.rest + Array.from(chunk, (byte) => String.fromCharCode(byte)).join("");
    const lines = text.split(/[\r\n]/), samples = [], parts = [];
    this.rest = lines.pop();
    for (const line of lines) {
      if (line.trim() && this.whole) this.line(line.trim(), now, samples, parts);
      this.whole = true;
    }
    if (this.rest.length > LONGEST) {
      if (this.whole) this.refuse(this.rest, new Refused(`more than ${LONGEST} bytes without a line end`), now);
      [this.whole, this.rest] = [false, ""];
    }
    parts.push(this.feed(samples));
    return (this.block = parts.length > 1 ? joined(parts) : parts[0]);
  }

  line(line, now, samples, parts) {
    if (line.startsWith("#")) return this.comment(line);
    try {
      const settled = this.format ?? new Format(line), values = settled.read(line), sample = sampleOf(values);
      const place = this.clock.place(values, now);
      if (!this.format) this.settle(settled, line, values);
      if (place.gap) {
        parts.push(this.feed(samples.splice(0)));
        this.gap(place);
      }
      this.lost += place.lost;
      samples.push({ ...sample, ...place });
      this.strange = 0;
      this.watch(sample, now);
    } catch (error) {
      if (!(error instanceof Refused) || error.final) throw error;
      this.refuse(line, error, now);
    }
  }

  settle(format, line, values) {
    this.format = format;
    this.settings = settingsOf(format);
    this.module.begin(this.settings);
    const shown = ["hard", "soft"].filter((role) => role in values).map((role) => `${role} ${values[role]} pF`);
    this.tell(`${quoted(line)}${shown.length ? ` -> ${shown.join(", ")}` : ""}${format.timed ? "" : "; without times: those of arrival are used, smoothed"}`);
  }

  // Says once that no pair has both values.
  watch({ status }, now) {
    if (status !== 8 || this.valued === null) this.valued = now;
    else if (now - this.valued >= NO_VALUE_S) {
      this.valued = Infinity;
      this.tell(`${this.name}: no pair with both values for ${NO_VALUE_S} s, the lines say overload, nan or nothing: check the probe's connection and the range of the instrument`);
    }
  }

  tell(text) {
    this.said = [...this.said, text].slice(-KEPT);
  }

  gap({ gap, lost, t_hard_ns }) {
    this.module.wasm.gap();
    this.note(this.module.touches());
    this.cut(this.end ?? 0, Number(t_hard_ns) * 1e-9, lost, gap);
    this.tell(gap);
  }

  refuse(line, error, now) {
    if (!this.strange) [this.since, this.firstStrange] = [now, line];
    this.strange += 1;
    if (this.format) this.errors += 1;
    if (this.format && /^10+$/.test(this.errors)) this.tell(`${this.errors} lines were not read; the last: ${quoted(line)}: ${error.message}`);
    const long = now - this.since >= PATIENCE_S;
    if (this.format ? long && this.strange >= STRANGE : long || this.strange >= STRANGE) {
      const lines = this.strange === 1 ? "1 line was" : `${this.strange} lines in a row were`;
      throw Object.assign(new Refused(`${this.name}: ${lines} not read. The first: ${quoted(this.firstStrange)}. Reason: ${error.message}`), { final: true });
    }
  }

  comment(line) {
    const told = `${this.name}: ${quoted(line)}`;
    if (this.said.length < SHOWN && !this.said.includes(told)) this.tell(told);
  }

  tare() {
    if (super.tare()) return true;
    throw new Refused("tare: got it while the probe is in contact, allowed: without contact. Lift the probe");
  }
}

function settingsOf(format) {
  const coded = format?.roles.includes("hard_raw");
  return { ...TABLES.scenes.handheld, full_scale: coded ? TABLES.full_scale_pF : Infinity, host_stamps: !format?.timed };
}

// Numbers and times of the samples. A board that restarts, or a counter of 32 bits that begins again, is a gap.
class Clock {
  constructor() {
    Object.assign(this, { next: 0, seq: null, own: null, arrived: 0, last: 0n, capdacs: null, restarts: 0, pairs: 0, own_s: 0, waited_s: 0, wrong: 0 });
  }

  // `now`: the arrival, s.
  place(values, now) {
    const arrived = BigInt(Math.round(now * 1e9)), hard = values.t_hard ?? values.t, apart = hard === undefined ? 0n : (values.t_soft ?? hard) - hard;
    const waited = Math.max(now - this.arrived, 1e-9);
    if (Math.abs(Number(apart)) > KNOWN.apart_s * 1e9) throw new Refused(`its channels are ${Number(apart) / 1e9} s apart; allowed: ${KNOWN.apart_s} s`);
    if (hard !== undefined && hard === this.own) throw new Refused("its time is that of the pair before");
    const gaps = [], step = this.own === null || hard === undefined ? 0n : hard - this.own, step_s = Number(step) / 1e9;
    if (step < 0n) gaps.push("the board restarted, or its counter began again: its clock went back");
    else if (step_s > waited + KNOWN.ahead_s) gaps.push("the clock of the board jumped ahead");
    if (step > 0n) this.judge(step_s, waited);
    const lost = this.count(values.seq, gaps);
    this.restarts = gaps.length ? this.restarts + 1 : 0;
    if (this.restarts >= KNOWN.restarts) throw Object.assign(new Refused(`the board restarts with each line, or does not count up: ${gaps[0]}`), { final: true });
    this.moved(values, gaps);
    const first = this.own === null, going = this.last + (step < 0n ? BigInt(Math.round(waited * 1e9)) : step);
    const at = hard === undefined ? arrived : first ? (arrived > -apart ? arrived : -apart) : going;
    [this.own, this.arrived, this.last] = [hard ?? null, now, at];
    return { seq: this.next++, t_hard_ns: at, t_soft_ns: at + apart, lost, gap: gaps.join("; ") };
  }

  count(seq, gaps) {
    const before = this.seq;
    this.seq = seq ?? null;
    if (seq === undefined || before === null) return 0;
    if (seq <= before) gaps.push(`the board restarted: seq ${seq} after ${before}`);
    const lost = Math.max(seq - before - 1, 0);
    this.next += lost;
    return lost;
  }

  moved({ capdac_hard: hard, capdac_soft: soft }, gaps) {
    const before = this.capdacs, now = `${hard}, ${soft}`;
    this.capdacs = now;
    if (before !== null && before !== now) gaps.push(`CAPDAC ${before} -> ${now}`);
  }

  // A wrong unit of the times shows twice in a row.
  judge(step_s, waited) {
    [this.pairs, this.own_s, this.waited_s] = [this.pairs + 1, this.own_s + step_s, this.waited_s + waited];
    if (this.pairs < KNOWN.wrong_pairs || this.waited_s < KNOWN.wrong_s) return;
    const ratio = this.own_s / this.waited_s, wrong = ratio > KNOWN.wrong ? 1 : ratio < 1 / KNOWN.wrong ? -1 : 0;
    const spans = `${this.own_s.toPrecision(4)} s went by in ${this.waited_s.toPrecision(4)} s of the computer's clock`;
    if (wrong && wrong === this.wrong) throw Object.assign(new Refused(`the times of the lines are not in their unit: by them ${spans}; allowed: a unit that is right, such as t_ms or t_us`), { final: true });
    [this.pairs, this.own_s, this.waited_s, this.wrong] = [0, 0, 0, wrong];
  }
}
