// A recording of palpate: its files, and its rows through the core. What is not as palpate writes it is refused.

import { Measurement, joined } from "./measurement.js";
import { quoted, require } from "./refused.js";
import { codesOf, crc32, infinite, marksOf, settingsOf, sidecarOf, utcOf } from "./sidecar.js";
import { Survey } from "./survey.js";
import { TABLES } from "./tables.js";

const MOST_ROWS = 4_000_000; // their columns have 200 MB
const LIKELY = 4096; // bytes whose capacitances are compared with their codes
const ROUNDED_PF = 1e-3; // what a spreadsheet may round
const LINE_END = 10, RETURN = 13;

// Reads dropped files: one recording, and its sidecar.
export async function recordingOf(module, files) {
  const { name, bytes, sidecar } = chosen(files), advice = `'palpate live ${name}' reads it`;
  require(bytes.length, `${name}: is empty`);
  const [columns, begin] = headed(name, bytes, advice);
  const found = sidecarOf(name.replace(/csv$/i, "json"), sidecar), document = found?.document ?? null;
  const device = document?.device ?? {}, plain = new Plain(module, columns.length === TABLES.columns.length, name, bytes, begin);
  const codes = document ? codesOf(device) : plain.likely();
  const first = document ? null : plain.first(codes);
  const full = document ? infinite("full_scale_pF" in device ? device.full_scale_pF : "inf") : first?.hard_raw >= 0 ? TABLES.full_scale_pF : Infinity;
  require(typeof full === "number" && full > 0, `full_scale_pF: got ${quoted(full)}, allowed: above 0`);
  const [scene, settings] = settingsOf(document, full, advice);
  const { marks, tares } = marksOf(document);
  const got = new Measurement(module, { kind: "file", name, device: String(device.name ?? ""), scene, settings });
  const survey = new Survey(got, tares, (codes ?? TABLES.codes).largest), parts = [];
  plain.form(codes);
  for (const count of plain.parts()) {
    require(survey.rows + count <= MOST_ROWS, `${name}: got more than ${MOST_ROWS} rows, allowed here: so many; ${advice}`);
    survey.take(count, parts);
  }
  got.note(module.wasm.finish() ? module.touches() : []);
  got.block = joined(parts);
  got.marks = marks;
  const doubts = doubtsOf(name, bytes, found, survey.rows), faults = [...plain.torn(), ...survey.faults];
  got.notes = [...unverified(name, files, found), ...doubts, ...faults, ...survey.notes(codes), ...said(document)];
  got.file = { name, rows: survey.rows, missing: survey.lost, end: verdict(document, doubts, faults, survey.rows), seconds: survey.seconds };
  got.utc = utcOf(document, got.origin);
  got.ended = true;
  return got;
}

function chosen(files) {
  const tables = files.filter(({ name }) => /\.csv$/i.test(name));
  const names = files.map(({ name }) => name).join(", ");
  const what = "allowed: a recording of palpate, NAME.csv, and beside it NAME.json";
  require(tables.length <= 1, `got ${tables.length} recordings (${names}), ${what}: one at a time`);
  require(tables.length, `got ${names || "no file"}, ${what}; 'palpate live FILE' reads tables of other programs, too, after: pip install palpate`);
  const [{ name, bytes }] = tables, beside = name.replace(/\.csv$/i, "").toLowerCase() + ".json";
  return { name, bytes, sidecar: files.find((file) => file.name.toLowerCase() === beside)?.bytes };
}

function headed(name, bytes, advice) {
  const end = bytes.indexOf(LINE_END), line = new TextDecoder("latin1").decode(bytes.subarray(0, Math.min(end < 0 ? bytes.length : end, 400))).replace(/\r$/, "");
  const columns = [TABLES.columns, TABLES.earlier].find((names) => names.join(",") === line);
  require(columns && end >= 0, `${name}: its first line is ${quoted(line)}, allowed here: ${TABLES.columns.join(",")}: it is no recording that palpate made, or its begin is damaged. After 'pip install palpate', ${advice}, if it has both channels`);
  return [columns, end + 1];
}

// The rows of a file, read by the core.
class Plain {
  constructor(module, uncertainty, name, bytes, begin) {
    Object.assign(this, { module, uncertainty, name, bytes, begin, rest: 0 });
  }

  form(codes) {
    this.module.wasm.form(this.uncertainty, codes !== null, codes?.zero ?? 0, codes?.per_pF ?? 1);
  }

  // The first row; undefined: there is none.
  first(codes) {
    this.form(codes);
    return this.few().next().value;
  }

  // The scale of the AD7746 if the first rows have it, else null: then the codes are left out.
  likely() {
    const values = [null, TABLES.codes].map((codes) => {
      this.form(codes);
      return [...this.few()].flatMap(({ hard, soft }) => [hard, soft]);
    });
    const near = (one, i) => Math.abs(one - values[1][i]) <= ROUNDED_PF || Number.isNaN(one) === Number.isNaN(values[1][i]) && Number.isNaN(one);
    return values[0].every(near) ? TABLES.codes : null;
  }

  *few() {
    const part = this.bytes.subarray(this.begin, this.begin + LIKELY), [count] = this.module.parse(part.subarray(0, part.lastIndexOf(LINE_END) + 1));
    for (let i = 0; i < count; i++) yield this.module.row(i);
  }

  // Reads it part by part, and says how many rows each has; they are the rows of the module then.
  *parts() {
    let at = this.begin, line = 2;
    while (at < this.bytes.length) {
      const part = this.bytes.subarray(at, at + this.module.room), size = part.lastIndexOf(LINE_END) + 1;
      if (!size) break;
      const [count, read] = this.module.parse(part.subarray(0, size));
      line += count;
      if (read < size) this.refuse(at + read, line);
      yield count;
      at += size;
    }
    this.rest = this.bytes.length - at;
    yield* this.last(at, line);
  }

  // A last row without a line end; what is no row then is one that was cut off, and zeros of a power cut.
  *last(at, line) {
    const rest = this.bytes.subarray(at), zero = rest.indexOf(0), text = zero < 0 ? rest : rest.subarray(0, zero);
    const [count, read] = text.length <= TABLES.longest_row && text.at(-1) !== RETURN ? this.module.parse(text) : [0, 0];
    if (count && read === text.length) {
      this.rest -= read;
      yield 1;
    }
    const filled = rest.findLastIndex((byte) => byte !== 0) + 1;
    if (filled > TABLES.longest_row) this.refuse(at, line);
  }

  refuse(at, line) {
    const end = this.bytes.indexOf(LINE_END, at), text = new TextDecoder().decode(this.bytes.subarray(at, Math.min(end < 0 ? this.bytes.length : end, at + 400)));
    require(false, `${this.name}: line ${line}: got ${quoted(text.replace(/\r$/, ""))}, allowed here: a row as palpate writes it. 'palpate live ${this.name}' reads rows that were written in another way, and leaves damaged ones out; 'palpate check ${this.name}' says what is damaged`);
  }

  torn() {
    return this.rest ? [`${this.rest} bytes after the last complete row, left out: the recording was not closed, or the file was cut`] : [];
  }
}

// Why nothing can be said of whether the rows are as they were written.
function unverified(name, files, found) {
  const json = name.replace(/csv$/i, "json"), others = files.map((file) => file.name).filter((other) => other !== name).join(", ");
  if (!found) return [`no sidecar: drop ${json} together with ${name}${others && ` (${others}: not used)`}. Without it the rows cannot be verified, and the device, its range and the settings are unknown`];
  const { end, checkpoint } = found.document;
  return [
    ...end ? [] : [`no end in the sidecar: the recording was not closed${checkpoint ? "" : " (it has no checkpoint)"}; 'palpate check ${name}' says more`],
    ...end && isOld(found.document) && !Number.isInteger(end.crc32) ? ["no checksum in the sidecar, which an older palpate wrote: only the number of rows is verified"] : [],
  ];
}

// What is not as it was written.
function doubtsOf(name, bytes, found, rows) {
  const { end = {} } = found?.document ?? {}, more = `'palpate check ${name}' says more`, told = [end.doubts ?? []].flat().map((text) => String(text).slice(0, 500));
  if (found?.intact === false) told.push(`the sidecar was changed after it was written (its checksum differs): device, settings, marks, end may be wrong; ${more}`);
  if (!found?.document.end) return told;
  if (end.rows !== rows) told.push(`${rows} rows in the file, but ${quoted(end.rows)} were written; ${more}`);
  else if (!Number.isInteger(end.crc32)) told.push(...isOld(found.document) ? [] : [`no checksum in the sidecar, which palpate always writes: the rows cannot be verified; ${more}`]);
  else if (!isSame(bytes, end)) told.push(`the rows were changed after they were written, or the sidecar belongs to another recording (its checksum differs): results may be wrong; ${more}`);
  return told;
}

const isOld = ({ schema }) => schema !== TABLES.schemas[0];

function isSame(bytes, { bytes: size, crc32: sum }) {
  const all = Number.isInteger(size) && size >= 0 ? bytes.subarray(0, size) : bytes;
  return (all.length === size || size === undefined) && crc32(all) === sum ? true : crc32(bytes.filter((byte) => byte !== RETURN)) === sum;
}

function said(document) {
  const { end = {}, notes = [] } = document ?? {};
  const failed = end.error ? [`${end.clean ? TABLES.source_failed : "the recorder stopped with an error"}: ${String(end.error).slice(0, 300)}`] : [];
  return [...failed, ...(end.repaired ? [`repaired: ${String(end.repaired).slice(0, 500)}`] : []), ...notes.map((note) => String(note).slice(0, 500))];
}

// What became of it, in the words of palpate.recording.verification.
function verdict(document, doubts, faults, rows) {
  if (!document) return "not verified";
  const { end = {}, notes = [] } = document, closed = end.clean || end.repaired !== undefined;
  if (!closed || doubts.length || faults.length) return closed && doubts.length && end.repaired === undefined && end.rows === rows ? "changed" : "not complete";
  if (end.repaired !== undefined) return "repaired";
  if (notes.some((note) => String(note).startsWith(TABLES.rescued))) return "rescued";
  return end.error ? "complete, until the source failed" : "complete, clean end";
}
