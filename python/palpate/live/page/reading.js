// The touch that is shown, and its number in words: the same ones at each depth.

import { clock, endsOf, grouped, modulusOf, number, plusMinus, settings } from "./formatting.js";

const WITH_ERRORS = ["handheld", "sliding"]; // scenes
const NEAR_S = 0.5; // between the clocks of the simulated hand and of the samples
const IN_CONTACT = ["contact", "adapting"];
export const COVERING = 1.96; // standard deviations: 95 %

// Of a file: which touch is shown.
export function fileWords({ chosen, touches, hello }) {
  const { rows } = touches;
  const words = { tone: "idle", share: null, word: grouped(rows.length), sub: "touches" };
  if (!chosen) return words;
  const begin = clock(rows[chosen - 1].start_s - hello.origin_s);
  return { ...words, word: grouped(chosen), sub: `of ${grouped(rows.length)}, at ${begin}` };
}

// The touch that is shown: the running one, the chosen one of a file, else the newest one; none while nothing can be measured.
export function subject({ hello, state, touches, chosen, offline }) {
  const file = hello.kind === "file";
  const last = touches.rows.at(-1);
  const picked = touches.rows.find((row) => row.number === chosen);
  if (offline) return last && { ...last, title: `touch ${last.number}, last known`, kind: "old" };
  if (state.now?.tone === "fault") return null;
  if (running(state)) return { ...state, title: `touch ${(last?.number ?? 0) + 1}`, kind: "" };
  const one = file ? picked ?? last : last;
  if (!one) return null;
  if (one.kept === false) return { ...one, title: `touch ${one.number}, left out`, kind: "left" };
  if (file || state.now?.share !== null) return { ...one, title: `touch ${one.number}`, kind: "" };
  const on = one.specimen ? `: ${one.specimen}` : "";
  return { ...one, title: `of touch ${one.number}${on}`, kind: "old" };
}

// The touch that a command for one touch means: the one that is chosen, else the newest one.
export function meantTouch({ touches, chosen }) {
  const picked = touches.rows.find((row) => row.number === chosen);
  return picked ?? touches.rows.at(-1) ?? null;
}

export function running(state) {
  return IN_CONTACT.includes(state.state) && state.ratio !== null;
}

// The press of a simulated hand that a touch, or now, belongs to, with its true ratio; none: not simulated, or no such ratio.
export function truthOf({ simulation }, { start_s: start, end_s: end }) {
  return simulation?.truths.findLast((press) => press.start_s < (start ?? end) + NEAR_S);
}

// Whether the standard error is not known, or a tenth of the ratio: then no number is shown.
export function isUnsure({ ratio, standard_error: error }, { scene }) {
  if (!WITH_ERRORS.includes(scene)) return false;
  return error === null || error === undefined || error >= Math.abs(ratio) / 10;
}

// Whether touches are shown by their modulus: not while a calibration is made.
export function showsModulus({ hello, calibration }) {
  return hello.calibrated && (!calibration.on || Boolean(calibration.saved));
}

// Texts of the number: the modulus with a calibration, else the ratio; and between which values it is, in 95 of 100 cases.
export function readingOf(one, known) {
  const { hello } = known;
  const of = one.title.charAt(0).toUpperCase() + one.title.slice(1);
  if (showsModulus(known) && one.modulus) return { of, ...modulusTexts(one.modulus) };
  if (isUnsure(one, hello)) return { of, value: "–", unit: "", between: "hold on: not known yet" };
  const { ratio, uncertainty } = one;
  if (!(uncertainty > 0)) return { of, value: number(ratio), unit: "", between: "uncertainty not known" };
  const ends = [ratio - COVERING * uncertainty, ratio + COVERING * uncertainty];
  const [low, high] = ends.map((end) => number(end, uncertainty));
  return { of, value: plusMinus(ratio, uncertainty)[0], unit: "", between: `between ${low} and ${high}` };
}

function modulusTexts(modulus) {
  const { value, interval, unit, more, shore } = modulusOf(modulus);
  if (!modulus) return { value: "–", unit: "", between: "hold on: not known yet" };
  if (unit) {
    const [low, high] = endsOf(interval);
    return { value, unit, between: `between ${low} and ${high}${more}`, shore };
  }
  const { low_MPa: low, high_MPa: high } = modulus;
  const factor = settings.unit === "kPa" ? 1000 : 1;
  if (low > 0 && high === null) return { value: `> ${number(factor * low)}`, unit: settings.unit, between: "stiffer than this probe can tell" };
  if (low === 0 && high > 0) return { value: `< ${number(factor * high)}`, unit: settings.unit, between: "softer than this probe can tell" };
  return { value: "–", unit: "", between: interval };
}
