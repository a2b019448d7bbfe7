// A serial port: bytes as they come, to lines, to samples. It reads the lines of docs/serial.md that need no option: each
// value has a name, and each capacitance a unit in it, or a code of the AD7746.

import { Measurement, Refused, require } from "./core.js";
import { GIVEN } from "./given.js";

const { columns: COLUMNS, picofarads: PICOFARADS, nanoseconds: NANOSECONDS, whole: WHOLE, marks: MARKS, codes: CODES } = GIVEN;
const CELL = /^([A-Za-z_][A-Za-z0-9_]*)[=:]([-+]?(?:[0-9.]+(?:[eE][-+]?[0-9]+)?|[A-Za-z]+))$/;
const NUMBER = /^[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?$/;
const FORM = "allowed here: names with values and units, such as hard_pF:1.2,soft_pF:3.4; 'palpate live serial:PORT' has options for other lines";
const OVERLOAD = 1e30; // an instrument without a value sends 9.9E+37
const LONGEST = 1000; // bytes of a line
const MOST_UNREAD = 20, PATIENCE_S = 10; // lines in a row, or the time, after which it is an error
const MESSAGES = 100, NO_VALUE_S = 5;
const AHEAD_S = 2; // a clock of the board that gets ahead by more was set
const PACE = 3, PACE_S = 10; // no clock is that wrong in this time, but a unit is
const LOST = 8; // palpate.Status
const TIMES = ["t", "t_hard", "t_soft"], CHANNELS = ["hard", "soft"];

// Reads lines; the first one that is read fixes the names of those after it.
export class Grammar {
  // Returns role -> value: pF, ns as a BigInt, or a whole number.
  read(line) {
    require(/^[\x20-\x7e\t]*$/.test(line), "it is not plain text: is the baud rate right?");
    const cells = split(line), labels = cells.map(({ label }) => label).sort().join();
    require((this.labels ?? labels) === labels, "its names are not as in the first lines");
    const roles = cells.map(({ column: [role] }) => role), has = (...names) => names.every((name) => roles.includes(name));
    require(new Set(roles).size === roles.length, "a name is there twice");
    require(has("hard", "soft") !== has("hard_raw", "soft_raw") && roles.filter((role) => /^(hard|soft)/.test(role)).length === 2, `it has not both channels, once each; ${FORM}`);
    require(has("t_hard") === has("t_soft") && !has("t", "t_hard"), "it has not one time t, or both times t_hard and t_soft");
    const values = Object.fromEntries(cells.map(({ column, text }) => [column[0], value(column, text)]));
    Object.assign(this, { labels, timed: has("t") || has("t_hard"), coded: has("hard_raw") });
    return values;
  }
}

function split(body) {
  const tight = body.replace(/\s+/g, " ").replace(/ ?([=:;|,]) ?/g, "$1");
  const [sign = " ", ...more] = [..."; | ,".replaceAll(" ", "")].filter((one) => tight.includes(one));
  require(!more.length, "it has several separators; a decimal comma is not read");
  return tight.split(sign).map((part) => {
    const [, label, text] = part.match(CELL) ?? [], column = COLUMNS[label?.toLowerCase()];
    require(label, `'${part}' is not a name with a value; ${FORM}`);
    require(column, `what is '${label}'? ${FORM}`);
    return { label, column, text };
  });
}

function value([role, unit], text) {
  const units = TIMES.includes(role) ? NANOSECONDS : CHANNELS.includes(role) ? PICOFARADS : null;
  if (!units) return whole(role, text);
  const none = MARKS.includes(text.replace(/^[-+]/, "").toUpperCase());
  require(unit || (none && units === PICOFARADS), `the unit of ${role} is not known: one of ${Object.keys(units).join(", ")}`);
  require(none || NUMBER.test(text), `'${text}' is not a number`);
  const number = none || Math.abs(Number(text)) >= OVERLOAD ? NaN : Number(text);
  return units === PICOFARADS ? number * units[unit || "pF"] : nanoseconds(text, number * units[unit], units[unit]);
}

function whole(role, text) {
  const [low, high] = WHOLE[role];
  require(/^-?[0-9]{1,20}$/.test(text) && Number(text) >= low && Number(text) <= high, `'${text}' is not a whole number from ${low} to ${high}`);
  return Number(text);
}

function nanoseconds(text, near, scale) {
  const found = /^[0-9]+$/.test(text) ? BigInt(text) * BigInt(scale) : BigInt(Number.isFinite(near) ? halfEven(near) : -1);
  require(found >= 0n && found < 1n << 62n, `'${text}' is not a time`);
  return found;
}

function halfEven(x) {
  const low = Math.floor(x);
  return x - low === 0.5 ? low + (low % 2) : Math.round(x);
}

// Codes, capacitances and status of the values of a line.
export function sampleOf(values) {
  const [hard_raw, hard] = channel(values, "hard"), [soft_raw, soft] = channel(values, "soft"), none = Number.isNaN(hard) || Number.isNaN(soft);
  const said = values.status ?? (none ? LOST : 0), [low, high] = GIVEN.saturated, full = (code) => !none && code >= 0 && !(code >= low && code <= high);
  require((said === LOST) === none, `its status is ${said}, but ${none ? "a value" : "no value"} is missing`);
  return { hard_raw, soft_raw, hard, soft, status: said | full(hard_raw) | (full(soft_raw) << 1) };
}

function channel(values, name) {
  const code = values[`${name}_raw`] ?? -1;
  return [code, values[name] ?? (code >= 0 ? (code - CODES.zero) / CODES.per_pF : NaN)];
}

// The measurement at a port.
export class Serial extends Measurement {
  constructor(core, name) {
    super(core, { kind: "live", name, device: "serial port", settings: { ...GIVEN.scenes.handheld, full_scale: Infinity } });
    Object.assign(this, { rest: "", whole: false, grammar: new Grammar(), settled: false, clock: new Clock(), waiting: [], unread: 0, errors: 0 });
  }

  // Takes what came from the port, and when, s. The rows are in `parts`.
  hear(chunk, at_s) {
    this.begun ??= at_s;
    const text = this.rest + String.fromCharCode(...chunk), lines = text.split(/[\r\n]/), now = at_s - this.begun;
    this.rest = lines.pop();
    for (const line of lines) {
      if (line.trim() && this.whole) this.line(line.trim(), now);
      this.whole = true; // the port may begin inside of a line
    }
    if (this.rest.length > LONGEST) {
      if (this.whole) this.refuse(this.rest, `more than ${LONGEST} bytes without a line end`, now);
      [this.whole, this.rest] = [false, ""];
    }
    this.flush();
  }

  line(line, now) {
    if (line.startsWith("#")) return this.say(line);
    let sample, place;
    try {
      const values = this.grammar.read(line);
      sample = sampleOf(values);
      place = this.clock.place(values, now);
      if (!this.settled) this.settle(line, values);
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      return this.refuse(line, error.message, now);
    }
    this.unread = 0;
    if (place.gap) this.follow(place);
    this.lost += place.lost;
    this.waiting.push({ ...sample, ...place });
    this.watch(sample, now);
  }

  settle(line, values) {
    this.settled = true;
    this.set({ ...this.settings, full_scale: this.grammar.coded ? GIVEN.full_scale_pF : Infinity, host_stamps: !this.grammar.timed });
    const shown = Object.entries(values).map(([role, one]) => (typeof one === "bigint" ? `${role} ${Number(one) / 1e9} s` : `${role} ${one}`));
    this.say(`${line} -> ${shown.join(", ")}${this.grammar.timed ? "" : "; without times: those of arrival are used, smoothed"}`);
  }

  // Gives the samples that wait to the tracker.
  flush() {
    for (const samples = this.waiting.splice(0); samples.length; ) {
      const some = samples.splice(0, this.core.wasm.most_rows());
      some.forEach((sample, i) => this.core.put(i, sample));
      this.take(0, some.length);
    }
  }

  follow({ gap, lost, t_hard_ns }) {
    this.flush();
    this.gap();
    this.showGap(this.end ?? 0, Number(t_hard_ns) * 1e-9, lost, gap);
    this.say(gap);
  }

  say(text) {
    if (!this.messages.includes(text)) this.messages = [...this.messages, text].slice(-MESSAGES);
  }

  // Says once that no pair has both values.
  watch({ status }, now) {
    if (status !== LOST) this.valued = now;
    else if (now - (this.valued ??= now) >= NO_VALUE_S) this.say(`no pair with both values for ${NO_VALUE_S} s: check the probe's connection and the range of the instrument`);
  }

  refuse(line, why, now) {
    if (!this.unread++) this.since = now;
    if (this.settled && /^10+$/.test(++this.errors)) this.say(`${this.errors} lines were not read; the last: ${line}: ${why}`);
    const long = now - this.since >= PATIENCE_S, many = this.unread >= MOST_UNREAD;
    if (this.settled ? long && many : long || many) throw new Refused(`${this.name}: no line is read. The last: '${line.slice(0, 100)}'. Reason: ${why}`);
  }
}

// Numbers and times of the samples. A board that restarts, or a counter that begins again, is a gap.
class Clock {
  next = 0;
  last = 0n; // time of the last sample, ns

  // `now`: the arrival, s.
  place(values, now) {
    const hard = values.t_hard ?? values.t, apart = hard === undefined ? 0n : (values.t_soft ?? hard) - hard, arrived = BigInt(Math.round(now * 1e9));
    const waited_s = now - (this.arrived ?? now), step_s = this.own === undefined ? 0 : Number(hard - this.own) / 1e9, capdac = `${values.capdac_hard}, ${values.capdac_soft}`;
    require(Math.abs(Number(apart)) < 1e10, `its channels are ${Number(apart) / 1e9} s apart; allowed: 10 s`);
    require(hard === undefined || hard !== this.own, "its time equals the time of the pair before");
    const back = step_s < 0, ahead = step_s > waited_s + AHEAD_S, stuck = values.seq <= this.seq;
    const gap = [[back, "the board restarted, its clock went back"], [ahead, "the clock of the board jumped ahead"], [stuck, `the board restarted: seq ${values.seq} after ${this.seq}`],
      [this.capdac !== undefined && this.capdac !== capdac, `CAPDAC ${this.capdac} -> ${capdac}`]].filter(([is]) => is).map(([, text]) => text).join("; ");
    if (gap || !this.from) this.from = { hard, now };
    const own_s = hard === undefined ? now - this.from.now : Number(hard - this.from.hard) / 1e9, passed_s = now - this.from.now;
    require(passed_s < PACE_S || (own_s < PACE * passed_s && own_s > passed_s / PACE), `the times are not in their unit: ${own_s.toPrecision(4)} s went by in ${passed_s.toPrecision(4)} s`);
    const lost = values.seq > this.seq ? values.seq - this.seq - 1 : 0;
    const first = arrived > -apart ? arrived : -apart; // no time is below 0
    const at = hard === undefined ? arrived : this.own === undefined ? first : this.last + (back || ahead ? BigInt(Math.round(waited_s * 1e9)) : hard - this.own);
    Object.assign(this, { own: hard, arrived: now, last: at, seq: values.seq, capdac, next: this.next + lost + 1 });
    return { seq: this.next - 1, t_hard_ns: at, t_soft_ns: at + apart, lost, gap };
  }
}
