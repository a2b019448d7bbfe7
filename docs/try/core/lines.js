// Labelled lines of a serial port, where each capacitance has a unit or is a code: a part of what docs/serial.md describes,
// and with the same values. What palpate does not read is not read here either.

import { quoted, require } from "./refused.js";
import { TABLES } from "./tables.js";

const { serial: KNOWN, codes: CODES } = TABLES;
const CELL = /^([A-Za-z_][A-Za-z0-9_.]*(?:[([][A-Za-z.]{1,6}[)\]])?)[=:]([+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?|[+-]?[A-Za-z]{2,8})(?: ?([A-Za-z%][A-Za-z.]{0,9}))?$/;
const UNLABELLED = "allowed here: lines with names and units, such as hard_pF:1.2,soft_pF:3.4; 'palpate live serial:PORT' reads many other forms, after: pip install palpate";
const known = (table, name) => (Object.hasOwn(table, name) ? table[name] : undefined);

// A line without its checksum, and whether it had one.
function unsummed(line) {
  require(/^[\x20-\x7e\t]*$/.test(line), `${quoted(line)} is not plain text: is the baud rate right?`);
  const [, body, digits] = line.match(/^(.*)\*([0-9a-fA-F]{2})$/) ?? [];
  if (digits === undefined) return [line.trim(), false];
  const sum = [...body].reduce((all, char) => all ^ char.charCodeAt(0), 0), told = sum.toString(16).toUpperCase().padStart(2, "0");
  require(sum === parseInt(digits, 16), `its checksum is ${digits}, but that of its text is ${told}`);
  return [body.trim(), true];
}

const tight = (text) => text.trim().replace(/\s+/g, " ").replace(/ ?([=:]) ?/g, "$1").replaceAll(" (", "(").replaceAll(" [", "[");

function split(body) {
  const kinds = KNOWN.separators.slice(0, -1).filter((one) => body.includes(one)), kind = kinds[0] ?? (tight(body).includes(" ") && !CELL.test(tight(body)) ? " " : "");
  require(kinds.length < 2 && body, `${quoted(body)} is not made of names with numbers; ${UNLABELLED}`);
  const parts = kind === "" ? [tight(body)] : kind === " " ? tight(body).split(" ") : body.split(kind).map(tight);
  const cells = parts.map((part) => {
    const [, label, text, unit = ""] = part.match(CELL) ?? [];
    require(label && (/\d/.test(text) || isMark(text)), `${quoted(part)} is not a name with a number; ${UNLABELLED}`);
    return { label, text, unit };
  });
  return [cells.length > 1 ? kind : "", cells];
}

const isMark = (text) => KNOWN.marks.includes(text.replace(/^[+-]+/, "").toUpperCase());

// What a name means: { role, unit }.
function column(name) {
  const plain = name.toLowerCase(), fixed = known(KNOWN.with_unit, plain), role = known(KNOWN.names, plain);
  if (fixed) return { role: fixed[0], unit: fixed[1] };
  if (role) return { role, unit: "" };
  const [, base, unit] = name.match(/^(.*?)[([](.*)[)\]]$/) ?? name.match(/^(.*)_(.*)$/) ?? [], found = base && known(KNOWN.names, base.trim().toLowerCase());
  require(found && unit, `what is ${quoted(name)}? ${UNLABELLED}`);
  factor(found, unit);
  return { role: found, unit };
}

function factor(role, unit) {
  const times = KNOWN.times.includes(role), table = times ? KNOWN.ns : ["hard", "soft"].includes(role) ? KNOWN.pF : {};
  const found = known(table, unit) ?? (times ? undefined : known(table, known(KNOWN.small, unit) ?? ""));
  require(found !== undefined, `${quoted(unit)} is not a unit of ${role}; allowed: ${Object.keys(table).join(", ") || "none"}`);
  return found;
}

// The format of the lines, from one of them.
export class Format {
  constructor(line) {
    const [body, summed] = unsummed(line), [kind, cells] = split(body), columns = cells.map(({ label }) => column(label));
    Object.assign(this, { kind, summed, columns, labels: cells.map(({ label }) => label), units: cells.map(({ unit }) => unit !== "") });
    this.roles = columns.map(({ role }) => role);
    const has = (role) => this.roles.includes(role), pair = ["hard", "soft"].every(has) !== ["hard_raw", "soft_raw"].every(has);
    const sides = this.roles.filter((role) => /^(hard|soft)(_raw)?$/.test(role)).length;
    require(new Set(this.roles).size === cells.length, `a name is there twice: ${quoted(line)}`);
    require(pair && sides === 2, `${quoted(line)} has not both channels, once each; ${UNLABELLED}`);
    require(has("t_hard") === has("t_soft") && !(has("t") && has("t_hard")), "it has not one time t, or both times t_hard and t_soft");
    columns.forEach(({ role, unit }, i) => {
      const needs = KNOWN.times.includes(role) ? "s, ms or us" : ["hard", "soft"].includes(role) ? "pF, fF" : "";
      require(!needs || unit || cells[i].unit, `the unit of ${role} is not said: ${needs}? ${UNLABELLED}`);
    });
    this.read(line);
  }

  get timed() {
    return this.roles.some((role) => KNOWN.times.includes(role));
  }

  // The values of a line, by their roles.
  read(line) {
    const [body, summed] = unsummed(line);
    require(summed === this.summed, summed ? "it has a checksum, the first lines had none" : "it has no checksum");
    const [kind, cells] = split(body), same = cells.length === this.labels.length && this.labels.every((name) => cells.some(({ label }) => label === name));
    require(kind === this.kind && same, "it has another form than the first lines");
    return Object.fromEntries(this.columns.map((one, i) => {
      const cell = cells.find(({ label }) => label === this.labels[i]);
      require((cell.unit !== "") === this.units[i] || isMark(cell.text), `${quoted(cell.text)} has ${this.units[i] ? "no" : "a"} unit, unlike in the first lines`);
      return [one.role, value(one, cell)];
    }));
  }
}

function value({ role, unit: own }, { text, unit: said }) {
  const range = known(KNOWN.ranges, role);
  if (range) {
    require(!said, `${role} has no unit`);
    require(/^-?\d{1,20}$/.test(text) && Number(text) >= range[0] && Number(text) <= range[1], `${quoted(text)} is not a whole number from ${range[0]} to ${range[1]}`);
    return Number(text);
  }
  require(role !== "temperature" || !said, "a unit of a temperature is not read here");
  const units = [own, said].filter(Boolean), factors = units.map((unit) => factor(role, unit));
  require(new Set(factors).size < 2, `${role} has several units: ${units.join(", ")}`);
  if (KNOWN.times.includes(role)) return nanoseconds(text, factors[0]);
  return numeric(text) * (factors[0] ?? 1);
}

function numeric(text) {
  const found = isMark(text) ? NaN : Number(text);
  return Math.abs(found) < KNOWN.overload ? found : NaN;
}

function nanoseconds(text, scale) {
  const exact = /^\d+$/.test(text), near = exact ? 0 : numeric(text) * scale;
  const found = exact ? BigInt(text) * BigInt(scale) : Number.isFinite(near) ? BigInt(halfEven(near)) : -1n;
  require(found >= 0n && found < BigInt(KNOWN.longest_ns), `${quoted(text)} is not a time`);
  return found;
}

function halfEven(x) {
  const low = Math.floor(x);
  return x - low === 0.5 ? low + (low % 2 === 0 ? 0 : 1) : Math.round(x);
}

// Codes, capacitances and status of the values.
export function sampleOf(values) {
  const [hard_raw, hard] = channel(values, "hard"), [soft_raw, soft] = channel(values, "soft");
  const lost = Number.isNaN(hard) || Number.isNaN(soft), said = values.status ?? (lost ? 8 : 0);
  require((said === 8) === lost, `its status is ${said}, but ${lost ? "a value" : "no value"} is missing`);
  const [low, high] = TABLES.saturated, full = (code) => !lost && code >= 0 && !(code >= low && code <= high);
  return { hard_raw, soft_raw, hard, soft, status: said | (full(hard_raw) ? 1 : 0) | (full(soft_raw) ? 2 : 0) };
}

function channel(values, name) {
  if (name in values) return [-1, values[name]];
  const code = values[`${name}_raw`];
  return [code, code >= 0 ? (code - CODES.zero) / CODES.per_pF : NaN];
}

