// Now: the word, how far the touch is, the number, and what is touched next.

import { $, fill, make, put } from "./dom.js";
import { clock, grouped, inUnit, modulusOf, plusMinus, settings, signed } from "./formatting.js";
import { outcome } from "./session.js";

const WITH_ERRORS = ["handheld", "sliding"]; // scenes
const NEAR_S = 0.5; // between the clocks of the simulated hand and of the samples
const SLOTS = 8; // more touches of a specimen are only counted
const NO_TOUCH = { number: "–", unit: "", pm: "", range: "no touch is measured", secondname: "Ratio", number2: "–", range2: "" };

export class Instruction {
  update(type, known) {
    const { length } = known.touches.rows, file = known.found && length > 0 && { tone: "idle", share: null, word: grouped(known.chosen ?? length), sub: known.chosen ? `of ${grouped(length)}, at ${clock(known.touches.rows[known.chosen - 1].start_s - known.hello.origin_s)}` : "touches" };
    this.showState(known.offline ? { word: "Offline", sub: `the last data is from ${known.offline}`, tone: "fault", share: null } : file || known.state.now);
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
    const one = subject(known), { hello, calibration } = known, byModulus = hello.calibrated && !calibration.on;
    const fit = calibration.on ? pointOf(calibration, one) : null, name = byModulus ? "Modulus" : "Ratio";
    for (const id of ["main", "second"]) $(id).className = one?.kind ?? "void";
    put("mainname", one ? `${name}, ${one.title}` : name);
    const done = known.state.now?.word === "Done" && known.session.done && outcome(known);
    if (done) $("main").className = $("second").className = "";
    const texts = done || (one ? numbersOf(one, hello, byModulus, fit) : NO_TOUCH);
    $("second").hidden = done ? !done.number2 : !byModulus && !fit;
    for (const [id, text] of Object.entries(texts)) put(id, text);
    $("main").style.setProperty("--em", width(texts).toFixed(2));
  }

  showNext(known) {
    const { hello, state, touches, session, offline } = known, one = subject(known), truth = one && truthOf(hello, one);
    if (offline) return this.showAside("Recorded", state.recording ? clock(state.recording.seconds ?? 0) : "–", `${state.recording ? `so far, ${grouped(state.recording.rows)} rows` : "nothing so far"}; what came later is not known`);
    if (state.line?.what === "touched") return this.showAside("Next", "Baseline", "by itself, a second after you lift");
    if (truth && !session.next) return this.showTruth(truth, one, hello);
    const next = session.next, rows = touches.rows, file = hello.kind === "file", { of: all, kept } = session.count ?? { of: rows.length, kept: rows.length };
    const small = next
      ? [`touch ${next.nth}${next.of ? ` of ${next.of}` : ""}`, next.modulus ? `${inUnit(next.modulus)} ${settings.unit}` : ""].filter(Boolean).join(" · ")
      : file ? `${all - kept} of them left out` : "specimens are not named";
    const large = next?.name ?? (file ? `${all} ${all === 1 ? "touch" : "touches"}` : `Touch ${(rows.at(-1)?.number ?? 0) + 1}`);
    const again = state.now?.tone === "caution" && state.now.word === "Repeat";
    this.showAside(file ? "Recorded" : "Next", large, small, next, again);
  }

  // Of a simulation: the true ratio, and where the estimate is.
  showTruth({ name, ratio }, one, hello) {
    const off = one.ratio - ratio, side = `The estimate is ${plusMinus(Math.abs(off), one.uncertainty)[0]} ${off < 0 ? "below" : "above"}.`;
    const inside = Math.abs(off) <= one.uncertainty ? "✓ inside ±" : "outside ±, as one touch in three";
    this.showAside(["True ratio", name].filter(Boolean).join(", "), plusMinus(ratio, one.uncertainty)[0], isUnsure(one, hello) ? "" : `${inside}. ${side}`);
  }

  showAside(head, large, small, next = null, again = false) {
    put("nexthead", head);
    $("next").className = head.startsWith("True ratio") ? "true" : "";
    fill($("nextname"), [large, small], () => [make("span", { textContent: large }), make("small", { textContent: small })]);
    fill($("slots"), [next, again], () => slots(next, again));
  }
}

// The running touch, else the newest one; none while nothing can be measured.
function subject({ hello, state, touches, chosen, offline }) {
  const last = touches.rows.at(-1), picked = touches.rows.find((one) => one.number === chosen);
  if (offline) return last && { ...last, title: `touch ${last.number}, last known`, kind: "old" };
  if (state.now?.tone === "fault") return null;
  if (running(state)) return { ...state, title: `touch ${(last?.number ?? 0) + 1}`, kind: "" };
  const one = hello.kind === "file" ? picked ?? last : last;
  if (!one) return null;
  if (one.kept === false) return { ...one, title: `touch ${one.number}, left out`, kind: "left" };
  const old = hello.kind !== "file" && state.now?.share === null;
  return { ...one, title: old ? `of touch ${one.number}${one.specimen ? `: ${one.specimen}` : ""}` : `touch ${one.number}`, kind: old ? "old" : "" };
}

export function running(state) {
  return ["contact", "adapting"].includes(state.state) && state.ratio !== null;
}

// The press of a simulated hand that a touch, or now, belongs to, with its true ratio; none: not simulated, or no such ratio.
export function truthOf({ simulation }, { start_s, end_s }) {
  return simulation?.truths.findLast((press) => press.start_s < (start_s ?? end_s) + NEAR_S);
}

function isUnsure({ ratio, standard_error: error }, { scene }) {
  return WITH_ERRORS.includes(scene) && !(error !== null && error < Math.abs(ratio) / 10);
}

// Texts of the large and the small number. A ratio whose standard error is not known, or a tenth of it, is not shown.
function numbersOf(one, hello, byModulus, fit) {
  const [ratio, sure] = isUnsure(one, hello) ? ["–", ""] : plusMinus(one.ratio, one.uncertainty);
  const from = sure ? `one standard deviation (k = 1), ${one.uncertainty_from}` : "uncertainty not known yet";
  if (byModulus) {
    const { value, interval, unit, more = "", shore } = modulusOf(one.modulus);
    const range = [(unit ? `${interval}, 95 %` : interval) + more, shore && `Shore ${shore.split(" ").reverse().join(" ")}`].filter(Boolean).join(" · ");
    return { number: value, unit, pm: "", range, secondname: "Ratio", number2: ratio, range2: sure ? `${sure} (k = 1, ${one.uncertainty_from})` : from };
  }
  const { scatter } = hello, distance = fit && { secondname: "From the curve", number2: `${signed(100 * (fit.ratio / fit.fitted - 1), 1)} %`, range2: scatter ? `scatter ${(100 * scatter).toFixed(1)} %` : "" };
  return { number: ratio, unit: "", pm: sure, range: from, ...distance };
}

// How wide the large number is with what stands behind it, in em of it: it shrinks to its box, and is never cut.
function width({ number, unit, pm }) {
  return number.length * 0.67 + (unit ? 0.1 + 0.31 * unit.length : 0) + (pm ? 0.3 + 0.28 * pm.length : 0);
}

function pointOf(calibration, one) {
  const point = calibration.points?.find((p) => p.touch === one?.number) ?? calibration.points?.at(-1);
  return point?.fitted ? point : null;
}

function slots(next, again) {
  if (!next?.of || next.of > SLOTS) return [];
  return Array.from({ length: next.of }, (_, i) => {
    const nth = i + 1, bad = again && nth === next.nth, done = nth < next.nth;
    return make("li", { className: bad ? "bad" : done ? "done" : nth === next.nth ? "here" : "", textContent: bad ? "▲" : done ? "✓" : nth });
  });
}
