// The sidecar NAME.json of a recording, as far as this page uses it. python/palpate/recording/sidecar.py has the format.

import { quoted, require } from "./refused.js";
import { TABLES } from "./tables.js";

const LISTS = ["notes", "marks"], OBJECTS = ["device", "settings", "clock", "session", "checkpoint", "end"];
const SUM = '"sidecar_crc32": "';
const FREE = ["scene", "seconds", "samples", "release", "full_scale", "host_stamps"]; // settings that may differ from their defaults

// Returns what the text says, or what holds without one: null.
export function sidecarOf(name, bytes) {
  if (!bytes) return null;
  const wrong = (what) => `${name}: ${what}: 'palpate check' says more of a recording and its sidecar`;
  require(bytes.length <= TABLES.largest_sidecar, wrong(`got ${bytes.length} bytes, allowed: ${TABLES.largest_sidecar}`));
  const text = new TextDecoder().decode(bytes);
  let document;
  try {
    document = JSON.parse(text);
  } catch (error) {
    require(false, wrong(`not JSON (${error.message})`));
  }
  require(TABLES.schemas.includes(document?.schema), wrong(`not the sidecar of a recording: schema: got ${quoted(document?.schema)}, allowed: ${TABLES.schemas.join(" or ")}`));
  for (const part of LISTS) {
    require(Array.isArray(document[part]) && document[part].length <= TABLES.most_marks, wrong(`${part}: allowed: a list of at most ${TABLES.most_marks}`));
  }
  for (const part of OBJECTS) {
    const there = document[part] ?? (["device", "settings"].includes(part) ? null : {});
    require(there !== null && typeof there === "object" && !Array.isArray(there), wrong(`${part}: got ${quoted(document[part])}, allowed: names and values`));
  }
  return { document, intact: intact(text) };
}

// Whether it is as it was written; null: it never had a checksum.
function intact(text) {
  const at = text.lastIndexOf(SUM);
  if (at < 0) return text.includes(`"${TABLES.schemas[0]}"`) ? null : false;
  const body = text.slice(0, at + SUM.length), sum = crc32(new TextEncoder().encode(body));
  return text.slice(body.length) === `${sum.toString(16).padStart(8, "0")}"\n}\n`;
}

// The scale of the codes of a device.
export function codesOf(device) {
  const given = device.codes ?? TABLES.codes, { zero, per_pF, largest } = given ?? {};
  const whole = (value, low) => Number.isInteger(value) && value >= low && value <= TABLES.most_code;
  const fits = Object.keys(given ?? {}).length === 3 && whole(zero, -TABLES.most_code - 1) && whole(largest, 1);
  require(fits && per_pF >= 1e-6 && per_pF <= 1e15, `codes: got ${quoted(given)}, allowed: zero, per_pF and largest, as palpate.sources.Codes has them`);
  return given;
}

// Scene and settings of the tracker, as those of the measurement were.
export function settingsOf(document, full_scale, advice) {
  const { device = {}, settings: given = {} } = document ?? {}, scene = given.scene ?? "handheld", own = TABLES.scenes[scene];
  require(own, `scene: got ${quoted(scene)}, allowed here: ${Object.keys(TABLES.scenes).join(", ")}; ${advice}`);
  for (const [name, value] of Object.entries(given)) {
    require(FREE.includes(name) || value === own[name], `${name}: got ${quoted(value)}, allowed here: ${quoted(own[name])}, as the scene has it; ${advice}`);
  }
  const found = { ...own, full_scale, host_stamps: device.stamps === "host", ...given };
  found.full_scale = infinite(found.full_scale);
  if ("samples" in given !== "seconds" in given) found["samples" in given ? "seconds" : "samples"] = null;
  const { seconds, samples, release } = found;
  require(seconds === null || (seconds > 0 && seconds <= 9e9), `seconds: got ${quoted(seconds)}, allowed: 0 < seconds <= 9e9, or null`);
  require(samples === null || (Number.isInteger(samples) && samples >= 1 && samples <= 4e9), `samples: got ${quoted(samples)}, allowed: a whole number >= 1, or null`);
  require(seconds === null || samples === null, `seconds: got ${seconds} beside samples ${samples}, allowed: one of them: a touch has one length`);
  require(release > 0 && release < 1, `release: got ${quoted(release)}, allowed: 0 < release < 1`);
  require(found.full_scale > 0, `full_scale: got ${quoted(found.full_scale)}, allowed: 0 < full_scale, pF`);
  return [scene, found];
}

export const infinite = (value) => (value === "inf" ? Infinity : value);

// Marks with their times; tares and gaps by the number of the sample before them.
export function marksOf(document) {
  const all = (document?.marks ?? []).filter((mark) => mark !== null && typeof mark === "object" && !Array.isArray(mark));
  const marks = all.filter(({ t_s: t }) => Number.isFinite(t)).map(({ t_s, text = "" }, i) => ({ id: i + 1, t_s, text: String(text).slice(0, 500) }));
  const tares = new Map();
  for (const { tare, seq, gap, text = "" } of all) {
    if (tare !== true || !Number.isInteger(seq) || seq < 0) continue;
    require(Number.isSafeInteger(seq), `marks: seq: got ${seq}, allowed here: below 2**53`);
    tares.set(seq, gap === true ? String(text).slice(0, 500) : tares.get(seq) ?? null);
  }
  return { marks, tares };
}

const TABLE = Uint32Array.from({ length: 256 }, (_, i) => {
  let value = i;
  for (let bit = 0; bit < 8; bit++) value = value & 1 ? (value >>> 1) ^ 0xedb88320 : value >>> 1;
  return value;
});

export function crc32(bytes) {
  let sum = 0xffffffff;
  for (let i = 0; i < bytes.length; i++) sum = (sum >>> 8) ^ TABLE[(sum ^ bytes[i]) & 255];
  return (sum ^ 0xffffffff) >>> 0;
}
