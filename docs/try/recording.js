// A recording of palpate, NAME.csv with its NAME.json, to the bits of `palpate replay`. What is not as it was written is refused.

import { Measurement, require } from "./core.js";
import { GIVEN } from "./given.js";

const FREE = [
  "scene",
  "seconds",
  "samples",
  "release",
  "full_scale",
  "host_stamps",
  "period",
  "confirmed",
  "contact_exponent",
  "age",
]; // settings that may differ from those of the scene
const HOLE_S = 0.25; // a hole without a mark is shown from here on; all are counted
const WORDS = 7; // of eight bytes, in a sample
const LINE_END = 10;

// files: [{ name, bytes }]
export function recordingOf(core, files) {
  const { name, bytes, document } = whole(files);
  const { device, settings: given, notes, end } = document;
  const [scene, settings] = settingsOf(device, given, name);
  const codes = device.codes ?? GIVEN.codes;
  const got = new Measurement(core, { name, device: String(device.name ?? ""), scene, settings });
  const rows = new Rows(got, document.marks);
  core.wasm.form(rows.head(name, bytes), true, codes.zero, codes.per_pF);
  for (const count of rows.parts(name, bytes)) rows.take(count);
  got.close();
  const useless = got.useless ? `, ${got.useless} without a value` : "";
  got.file = {
    name,
    said: `A recording: ${verdictOf(end, got.lost)}, ${got.rows} rows, ${got.lost} missing${useless}. Nothing is being measured.`,
  };
  got.messages = [...(end.error ? [`the source failed: ${end.error}`] : []), ...notes.map(String)];
  return got;
}

// What became of a recording, in the words of `palpate check`.
function verdictOf(end, lost) {
  if (end.repaired !== undefined) return "repaired";
  const samples = lost ? "samples lost" : "complete";
  return end.error ? `${samples}, until the source failed` : `${samples}, clean end`;
}

// The two files of a recording, with nothing missing and nothing changed.
function whole(files) {
  const names = files.map(({ name }) => name).join(", ");
  const tables = files.filter(({ name }) => /\.csv$/i.test(name));
  require(tables.length ===
    1, `got ${names}, allowed: one recording of palpate, NAME.csv with its NAME.json; 'palpate live FILE' reads tables of other programs, too, after: pip install palpate`);
  const [{ name, bytes }] = tables;
  const beside = name.replace(/csv$/i, "json");
  const json = files.find((file) => file.name.toLowerCase() === beside.toLowerCase());
  require(json, `got ${names}, allowed: ${name} together with ${beside}, which says device, settings, and whether all rows are there; 'palpate live ${name}' reads it alone, after: pip install palpate`);
  const text = new TextDecoder().decode(json.bytes);
  const wrong = (what) => `${beside}: ${what}: 'palpate check ${name}' says more`;
  let document;
  try {
    document = JSON.parse(text);
  } catch (error) {
    require(false, wrong(`not JSON (${error.message})`));
  }
  const { end } = document;
  require(GIVEN.schemas.includes(document.schema), wrong(
    `schema: got ${document.schema}, allowed: ${GIVEN.schemas.join(" or ")}`,
  ));
  require(document.schema === GIVEN.schemas[0] || isUnchanged(text), wrong(
    "it was changed after it was written (its checksum differs)",
  ));
  require(end?.clean || end?.repaired !== undefined, wrong("no end: the recording was not closed"));
  require(end.crc32 === crc32(bytes), wrong(
    `${name} is not as it was written (its checksum differs, or is not there)`,
  ));
  require(!end.doubts, wrong(`the end of the recording: ${end.doubts}`));
  return { name, bytes, document };
}

// The sidecar ends with the checksum of all before it.
function isUnchanged(text) {
  const name = '"sidecar_crc32": "';
  const begin = text.lastIndexOf(name) + name.length;
  const sum = crc32(new TextEncoder().encode(text.slice(0, begin)));
  return text.slice(begin) === `${sum.toString(16).padStart(8, "0")}"\n}\n`;
}

const TABLE = Uint32Array.from({ length: 256 }, (_, i) => {
  let value = i;
  for (let bit = 0; bit < 8; bit++) value = value & 1 ? (value >>> 1) ^ 0xedb88320 : value >>> 1;
  return value;
});

function crc32(bytes) {
  let sum = 0xffffffff;
  for (let i = 0; i < bytes.length; i++) sum = (sum >>> 8) ^ TABLE[(sum ^ bytes[i]) & 255];
  return (sum ^ 0xffffffff) >>> 0;
}

const EARLIER = { drift: 0.75, threshold: 10 }; // the defaults, in the recordings of earlier versions

// Scene and settings of the tracker, as those of the measurement were.
function settingsOf(device, given, name) {
  const scene = given.scene ?? "handheld";
  const own = GIVEN.scenes[scene];
  const advice = `'palpate live ${name}' reads it, after: pip install palpate`;
  require(own, `scene: got ${scene}, allowed here: ${Object.keys(GIVEN.scenes).join(", ")}; ${advice}`);
  for (const [key, value] of Object.entries(given)) {
    const allowed = key in EARLIER ? EARLIER[key] : own[key];
    require(FREE.includes(key) ||
      value ===
        allowed, `${key}: got ${value}, allowed here: ${allowed}, as the scene has it; ${advice}`);
  }
  const found = {
    ...own,
    full_scale: device.full_scale_pF ?? Infinity,
    host_stamps: device.stamps === "host",
    ...given,
  };
  if ("samples" in given !== "seconds" in given)
    found["samples" in given ? "seconds" : "samples"] = null;
  return [
    scene,
    { ...found, full_scale: Number(String(found.full_scale).replace("inf", "Infinity")) },
  ];
}

// The rows on their way to the tracker, with the gaps and tares between them.
class Rows {
  constructor(got, marks) {
    Object.assign(this, { got, seq: null, ns: 0n, breaks: new Map() }); // number of a sample -> text of the gap after it; null: a tare
    got.marks = marks
      .filter(({ t_s: t }) => typeof t === "number")
      .map(({ t_s, text = "" }, i) => ({ id: i + 1, t_s, text }));
    for (const { tare, seq, gap, text } of marks)
      if (tare) this.breaks.set(seq, gap ? text : (this.breaks.get(seq) ?? null));
  }

  // Reads the header; whether the rows have the uncertainty of their times.
  head(name, bytes) {
    this.begin = bytes.indexOf(LINE_END) + 1;
    const line = new TextDecoder().decode(bytes.subarray(0, this.begin)).trim();
    const found = GIVEN.headers.indexOf(line);
    require(found >=
      0, `${name}: its first line is '${line.slice(0, 80)}', allowed here: ${GIVEN.headers[0]}`);
    return found === 0;
  }

  // Reads the file part by part; yields how many rows the core holds then.
  *parts(name, bytes) {
    for (let at = this.begin; at < bytes.length;) {
      const part = bytes.subarray(at, at + this.got.core.wasm.most());
      const size = part.lastIndexOf(LINE_END) + 1;
      const [count, read] = this.got.core.parse(part.subarray(0, size));
      require(size &&
        read ===
          size, `${name}: the row after sample ${this.seq ?? "-"} is not as palpate writes it: 'palpate live ${name}' reads other forms`);
      yield count;
      at += size;
    }
  }

  take(count) {
    const { wasm } = this.got.core;
    const words = new BigInt64Array(wasm.memory.buffer, wasm.rows(), WORDS * count);
    let begin = 0;
    for (let i = 0; i < count; i++) {
      this.follow(words[WORDS * i], words[WORDS * i + 1]);
      if (!this.breaks.has(Number(this.seq))) continue;
      this.got.take(begin, (begin = i + 1));
      if (this.breaks.get(Number(this.seq)) === null) this.got.tare();
      else this.got.gap();
    }
    this.got.take(begin, count);
  }

  // Counts what is missing before a row, and shows a gap there.
  follow(seq, ns) {
    const { got } = this;
    const lost = this.seq === null ? 0 : Math.max(0, Number(seq - this.seq) - 1);
    const text = this.seq === null ? null : (this.breaks.get(Number(this.seq)) ?? null);
    const before_s = Number(this.ns) * 1e-9;
    const now_s = Number(ns) * 1e-9;
    got.lost += lost;
    if (text !== null || (lost && now_s - before_s >= HOLE_S))
      got.gaps.push({
        from_s: before_s,
        to_s: now_s,
        lost,
        text: text ?? `${lost} pairs are missing`,
      });
    [this.seq, this.ns] = [seq, ns];
  }
}
