// The sidecar NAME.json of a recording, as far as this page uses it. python/palpate/recording/sidecar.py has the format.

import { quoted, require } from "./refused.js";
import { TABLES } from "./tables.js";

const LISTS = ["notes", "marks"], OBJECTS = ["device", "settings"], OPTIONAL = ["clock", "session", "checkpoint", "end"];
const LONGEST = 500, LATEST_S = 2 ** 63 / 1e9; // of a text; of a time
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
  for (const part of [...OBJECTS, ...OPTIONAL.filter((name) => name in document)]) {
    require(isObject(document[part]), wrong(`${part}: got ${quoted(document[part])}, allowed: names and values`));
  }
  return { document, intact: intact(text) };
}

const isObject = (value) => value !== null && typeof value === "object" && !Array.isArray(value);
const isNumber = (value) => typeof value === "number";

// Whether it is as it was written; null: it never had a checksum.
function intact(text) {
  const at = text.lastIndexOf(SUM);
  if (at < 0) return text.includes(`"${TABLES.schemas[0]}"`) ? null : false;
  const body = text.slice(0, at + SUM.length), sum = crc32(new TextEncoder().encode(body));
  return text.slice(body.length) === `${sum.toString(16).padStart(8, "0")}"\n}\n`;
}

// The scale of the codes of a device.
export function codesOf(device) {
  const given = "codes" in device ? device.codes : TABLES.codes, { zero, per_pF, largest } = given ?? {};
  const whole = (value, low) => Number.isInteger(value) && value >= low && value <= TABLES.most_code;
  const fits = isObject(given) && Object.keys(given).length === 3 && isNumber(per_pF) && whole(zero, -TABLES.most_code - 1) && whole(largest, 1);
  require(fits && per_pF >= 1e-6 && per_pF <= 1e15, `codes: got ${quoted(given)}, allowed: zero, per_pF and largest, as palpate.sources.Codes has them`);
  return given;
}

// Scene and settings of the tracker, as those of the measurement were.
export function settingsOf(document, full_scale, advice) {
  const { device = {}, settings: given = {} } = document ?? {}, scene = given.scene ?? "handheld";
  require(Object.hasOwn(TABLES.scenes, scene), `scene: got ${quoted(scene)}, allowed here: ${Object.keys(TABLES.scenes).join(", ")}; ${advice}`);
  const own = TABLES.scenes[scene];
  for (const [name, value] of Object.entries(given)) {
    require(FREE.includes(name) || value === own[name], `${name}: got ${quoted(value)}, allowed here: ${quoted(own[name])}, as the scene has it; ${advice}`);
  }
  const found = { ...own, full_scale, host_stamps: device.stamps === "host", ...given };
  found.full_scale = infinite(found.full_scale);
  if ("samples" in given !== "seconds" in given) found["samples" in given ? "seconds" : "samples"] = null;
  const { seconds, samples, release } = found;
  require(seconds === null || (isNumber(seconds) && seconds > 0 && seconds <= 9e9), `seconds: got ${quoted(seconds)}, allowed: 0 < seconds <= 9e9, or null`);
  require(samples === null || (Number.isInteger(samples) && samples >= 1 && samples <= 4e9), `samples: got ${quoted(samples)}, allowed: a whole number >= 1, or null`);
  require(seconds === null || samples === null, `seconds: got ${seconds} beside samples ${samples}, allowed: one of them: a touch has one length`);
  require(isNumber(release) && release > 0 && release < 1, `release: got ${quoted(release)}, allowed: 0 < release < 1`);
  require(typeof found.host_stamps === "boolean", `host_stamps: got ${quoted(found.host_stamps)}, allowed: true or false`);
  require(isNumber(found.full_scale) && found.full_scale > 0, `full_scale: got ${quoted(found.full_scale)}, allowed: 0 < full_scale, pF`);
  return [scene, found];
}

// As palpate.errors.shortened.
function shortened(value) {
  const text = String(value);
  return text.length <= LONGEST ? text : `${text.slice(0, LONGEST)}... (${text.length.toLocaleString("en")} characters)`;
}

// UTC of a time of the recording, as ISO 8601; null: not known.
export function utcOf(document, at_s) {
  const zero = document?.clock?.zero_utc_ns;
  const known = isNumber(zero) && zero >= 0 && zero < 2 ** 63 && at_s !== null && Math.abs(at_s) < 1e11;
  return known ? new Date(zero / 1e6 + at_s * 1e3).toISOString() : null;
}

export const infinite = (value) => (value === "inf" ? Infinity : value);

// Marks with their times; tares and gaps by the number of the sample before them.
export function marksOf(document) {
  const all = (document?.marks ?? []).filter(isObject);
  const marks = all.filter(({ t_s: t }) => Math.abs(isNumber(t) ? t : NaN) < LATEST_S).map(({ t_s, text = "" }, i) => ({ id: i + 1, t_s, text: shortened(text) }));
  const tares = new Map();
  for (const { tare, seq, gap, text = "" } of all) {
    if (tare !== true || !Number.isInteger(seq) || seq < 0) continue;
    require(Number.isSafeInteger(seq), `marks: seq: got ${seq}, allowed here: below 2**53`);
    tares.set(seq, gap === true ? shortened(text) : tares.get(seq) ?? null);
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
