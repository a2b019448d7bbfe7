// The instruction of the Lab: the word, how far the touch is, the number, and what is touched next.

import { $, put } from "./dom.js";
import { clock, grouped, inUnit, number, plusMinus, settings } from "./formatting.js";
import { fileWords, isUnsure, readingOf, subject, truthOf } from "./reading.js";

export class Instruction {
  update(type, known) {
    const { hello, state, touches, offline } = known;
    let now = state.now;
    if (offline) now = { word: "Offline", sub: `the last data is from ${offline}`, tone: "fault", share: null };
    else if (hello.kind === "file" && touches.rows.length) now = fileWords(known);
    if (now) this.showState(now);
    this.showNumbers(known);
    const { head, large, small } = besideWords(known);
    put("nexthead", head);
    put("nextname", large);
    put("nextwords", small);
  }

  showState(now) {
    if ($("state").dataset.tone !== now.tone) $("state").dataset.tone = now.tone;
    put("word", now.word);
    put("sub", now.sub);
    $("bar").firstChild.style.width = `${100 * (now.share ?? 0)}%`;
    $("state").classList.toggle("still", now.share === null);
  }

  showNumbers(known) {
    const one = subject(known);
    const texts = one ? readingOf(one, known) : { of: "No touch", value: "–", unit: "", between: "no touch is measured" };
    $("result").className = one?.kind ?? "void";
    put("mainname", texts.of);
    put("number", texts.value);
    put("unit", texts.unit);
    const words = [texts.between];
    if (one) words.push(...ratioWords(one, known.hello));
    if (texts.shore) words.push(`Shore ${texts.shore}`);
    put("range", words.join(" · "));
  }
}

function ratioWords(one, hello) {
  if (isUnsure(one, hello) || !(one.uncertainty > 0)) return [];
  const [ratio, error] = plusMinus(one.ratio, one.uncertainty);
  return [`ratio ${ratio} ${error} (k = 1, ${one.uncertainty_from})`];
}

function besideWords(known) {
  const { hello, state, touches, session, offline } = known;
  const rows = touches.rows;
  const next = session.next;
  const one = subject(known);
  const truth = one && truthOf(hello, one);
  if (offline) return recordedWords(state.recording);
  if (state.line?.what === "touched") return { head: "Next", large: "Baseline", small: "by itself, a second after you lift" };
  if (truth && !next) return truthWords(truth, one, hello);
  if (hello.kind === "file") {
    const { of: all, kept } = session.count ?? { of: rows.length, kept: rows.length };
    return { head: "Recorded", large: `${all} ${all === 1 ? "touch" : "touches"}`, small: `${all - kept} of them left out` };
  }
  if (!next) return { head: "Next", large: `Touch ${(rows.at(-1)?.number ?? 0) + 1}`, small: "specimens are not named" };
  const words = [`touch ${next.nth}${next.of ? ` of ${next.of}` : ""}`];
  if (next.modulus) words.push(`${inUnit(next.modulus)} ${settings.unit}`);
  return { head: "Next", large: next.name, small: words.join(" · ") };
}

function recordedWords(recording) {
  const rows = recording ? `so far, ${grouped(recording.rows)} rows` : "nothing so far";
  return { head: "Recorded", large: recording ? clock(recording.seconds ?? 0) : "–", small: `${rows}; what came later is not known` };
}

// Of a simulation: the true ratio, and where the estimate is.
function truthWords({ name, ratio }, one, hello) {
  const off = one.ratio - ratio;
  const distance = plusMinus(Math.abs(off), one.uncertainty)[0];
  const inside = Math.abs(off) <= one.uncertainty ? "✓ inside ±" : "outside ±, as one touch in three";
  const small = `${inside}. The estimate is ${distance} ${off < 0 ? "below" : "above"}.`;
  return { head: ["True ratio", name].filter(Boolean).join(", "), large: number(ratio), small: isUnsure(one, hello) ? "" : small };
}
