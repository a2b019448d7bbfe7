// The instruction of the Lab: the word, how far the touch is, the number, and what is touched next.

import { $, fill, make, put } from "./dom.js";
import { clock, grouped, inUnit, modulusOf, number, plusMinus, settings, signed } from "./formatting.js";

const WITH_ERRORS = ["handheld", "sliding"]; // scenes
const NEAR_S = 0.5; // between the clocks of the simulated hand and of the samples
const SLOTS = 8; // more touches of a specimen are only counted
const IN_CONTACT = ["contact", "adapting"];
const NO_TOUCH = { number: "–", unit: "", pm: "", range: "no touch is measured", secondname: "Ratio", number2: "–", range2: "" };

export class Instruction {
  update(type, known) {
    const { hello, state, touches, offline } = known;
    let now = state.now;
    if (offline) now = { word: "Offline", sub: `the last data is from ${offline}`, tone: "fault", share: null };
    else if (hello.kind === "file" && touches.rows.length) now = fileWords(known);
    this.showState(now);
    this.showNumbers(known);
    this.showNext(known);
  }

  showState(now) {
    if (!now) return;
    if ($("state").dataset.tone !== now.tone) $("state").dataset.tone = now.tone;
    put("word", now.word);
    put("sub", now.sub);
    $("bar").firstChild.style.width = `${100 * (now.share ?? 0)}%`;
    $("state").classList.toggle("still", now.share === null);
  }

  showNumbers(known) {
    const one = subject(known);
    const { hello, calibration } = known;
    const byModulus = hello.calibrated && !calibration.on;
    const fit = calibration.on ? pointOf(calibration, one) : null;
    const name = byModulus ? "Modulus" : "Ratio";
    for (const id of ["main", "second"]) $(id).className = one?.kind ?? "void";
    put("mainname", one ? `${name}, ${one.title}` : name);
    const texts = one ? numbersOf(one, hello, byModulus, fit) : NO_TOUCH;
    $("second").hidden = !byModulus && !fit;
    for (const [id, text] of Object.entries(texts)) put(id, text);
    $("main").style.setProperty("--em", widthOf(texts).toFixed(2));
  }

  showNext(known) {
    const { hello, state, touches, session, offline } = known;
    const one = subject(known);
    const truth = one && truthOf(hello, one);
    const rows = touches.rows;
    if (offline) return this.showRecorded(state.recording);
    if (state.line?.what === "touched") return this.showAside("Next", "Baseline", "by itself, a second after you lift");
    if (truth && !session.next) return this.showTruth(truth, one, hello);
    if (hello.kind === "file") {
      const { of: all, kept } = session.count ?? { of: rows.length, kept: rows.length };
      return this.showAside("Recorded", `${all} ${all === 1 ? "touch" : "touches"}`, `${all - kept} of them left out`);
    }
    const next = session.next;
    if (!next) return this.showAside("Next", `Touch ${(rows.at(-1)?.number ?? 0) + 1}`, "specimens are not named");
    const words = [`touch ${next.nth}${next.of ? ` of ${next.of}` : ""}`];
    if (next.modulus) words.push(`${inUnit(next.modulus)} ${settings.unit}`);
    const again = state.now?.tone === "caution" && state.now.word === "Repeat";
    this.showAside("Next", next.name, words.join(" · "), next, again);
  }

  showRecorded(recording) {
    const rows = recording ? `so far, ${grouped(recording.rows)} rows` : "nothing so far";
    this.showAside("Recorded", recording ? clock(recording.seconds ?? 0) : "–", `${rows}; what came later is not known`);
  }

  // Of a simulation: the true ratio, and where the estimate is.
  showTruth({ name, ratio }, one, hello) {
    const off = one.ratio - ratio;
    const distance = plusMinus(Math.abs(off), one.uncertainty)[0];
    const inside = Math.abs(off) <= one.uncertainty ? "✓ inside ±" : "outside ±, as one touch in three";
    const side = `The estimate is ${distance} ${off < 0 ? "below" : "above"}.`;
    const head = ["True ratio", name].filter(Boolean).join(", ");
    this.showAside(head, number(ratio), isUnsure(one, hello) ? "" : `${inside}. ${side}`);
  }

  showAside(head, large, small, next = null, again = false) {
    put("nexthead", head);
    $("next").className = head.startsWith("True ratio") ? "true" : "";
    fill($("nextname"), [large, small], () => [make("span", { textContent: large }), make("small", { textContent: small })]);
    fill($("slots"), [next, again], () => slots(next, again));
  }
}

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

// Texts of the large and the small number.
function numbersOf(one, hello, byModulus, fit) {
  const [ratio, sure] = isUnsure(one, hello) ? ["–", ""] : plusMinus(one.ratio, one.uncertainty);
  const from = sure ? `one standard deviation (k = 1), ${one.uncertainty_from}` : "uncertainty not known yet";
  if (byModulus) {
    const range2 = sure ? `${sure} (k = 1, ${one.uncertainty_from})` : from;
    return { ...modulusTexts(one.modulus), pm: "", secondname: "Ratio", number2: ratio, range2 };
  }
  const texts = { number: ratio, unit: "", pm: sure, range: from };
  if (!fit) return texts;
  const distance = `${signed(100 * (fit.ratio / fit.fitted - 1), 1)} %`;
  const scatter = hello.scatter ? `scatter ${(100 * hello.scatter).toFixed(1)} %` : "";
  return { ...texts, secondname: "From the curve", number2: distance, range2: scatter };
}

function modulusTexts(modulus) {
  const { value, interval, unit, more = "", shore } = modulusOf(modulus);
  const words = [(unit ? `${interval}, 95 %` : interval) + more];
  if (shore) words.push(`Shore ${shore.split(" ").reverse().join(" ")}`);
  return { number: value, unit, range: words.filter(Boolean).join(" · ") };
}

// How wide the large number is with what stands behind it, in em of it: it shrinks to its box, and is never cut.
function widthOf({ number, unit, pm }) {
  const unitWidth = unit ? 0.1 + 0.31 * unit.length : 0;
  const errorWidth = pm ? 0.3 + 0.28 * pm.length : 0;
  return number.length * 0.67 + unitWidth + errorWidth;
}

// The point of this touch on the curve; none: it is not on it.
function pointOf(calibration, one) {
  const point = calibration.points?.find(({ touch }) => touch === one?.number);
  return point?.fitted ? point : null;
}

function slots(next, again) {
  const children = [];
  const count = next?.of > SLOTS ? 0 : next?.of ?? 0;
  for (let nth = 1; nth <= count; nth += 1) {
    if (nth < next.nth) children.push(make("li", { className: "done", textContent: "✓" }));
    else if (nth > next.nth) children.push(make("li", { textContent: nth }));
    else children.push(make("li", { className: again ? "bad" : "here", textContent: again ? "▲" : nth }));
  }
  return children;
}
