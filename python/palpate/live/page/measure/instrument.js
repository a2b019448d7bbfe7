// The instrument: what to do and why, the number with its interval in words, or what mends a fault.

import { $, put } from "../dom.js";
import { endsOf, modulusOf, number, plusMinus, settings } from "../formatting.js";
import { isUnsure, subject } from "../instruction.js";

const ALARMED = ["fault", "caution"];
const COVERING = 1.96; // standard deviations: 95 %
const WHOLE = 100; // length of the ring

// What a button can mend: key of the line -> id of the button that does it.
const MENDS = { baseline: "tare", touched: "tare", range: "centre", "at its end": "centre", ended: "again" };

export class Instrument {
  constructor() {
    $("remedydo").onclick = () => $(this.mend).click();
  }

  update(type, known) {
    if (!known.state.now) return;
    const { now, line } = known.offline ? offline(known) : known.state;
    const alarmed = ALARMED.includes(now.tone);
    this.showRing(now, line, alarmed);
    this.showRemedy(now, line, alarmed);
    this.showReading(known);
  }

  showRing(now, line, alarmed) {
    $("instrument").dataset.tone = now.tone;
    put("verb", now.word);
    put("reason", alarmed ? withoutStop(line.title) : now.reason || now.sub);
    $("held").style.strokeDasharray = `${WHOLE * (now.share ?? 0)} ${2 * WHOLE}`;
    $("asked").style.setProperty("--letters", Math.max(5, ...now.word.split(" ").map((word) => word.length)));
  }

  showRemedy(now, line, alarmed) {
    $("reading").hidden = alarmed;
    $("remedy").hidden = !alarmed;
    document.body.classList.toggle("remedied", alarmed);
    if (!alarmed) return;
    put("remedyhow", capital(now.sub));
    put("remedywhy", line.text);
    this.mend = MENDS[line.what];
    const button = $(this.mend);
    $("remedydo").hidden = !button || button.hidden || button.disabled;
    if (button) put("remedydo", button.firstChild.textContent.trim());
  }

  showReading(known) {
    const one = subject(known);
    const texts = one ? readingOf(one, known) : { of: "", value: "–", unit: "", between: "no touch yet" };
    put("readingof", texts.of);
    put("value", texts.value);
    put("valueunit", texts.unit);
    put("between", texts.between);
    $("reading").dataset.kind = one?.kind ?? "void";
    $("figure").style.setProperty("--em", widthOf(texts).toFixed(2));
  }
}

function offline({ offline: since }) {
  const line = { what: "offline", title: "No connection.", text: `The last data is from ${since}. Look at the terminal of palpate.` };
  return { now: { word: "Offline", sub: "the page tries again by itself", tone: "fault", share: null }, line };
}

// Texts of the number: the modulus with a calibration, else the ratio; and between which values it is, in 95 of 100 cases.
export function readingOf(one, { hello, calibration }) {
  const of = one.title.charAt(0).toUpperCase() + one.title.slice(1);
  if (hello.calibrated && !calibration.on) return { of, ...modulusTexts(one.modulus) };
  if (isUnsure(one, hello)) return { of, value: "–", unit: "", between: "hold on: not known yet" };
  const { ratio, uncertainty } = one;
  if (!(uncertainty > 0)) return { of, value: number(ratio), unit: "", between: "uncertainty not known" };
  const ends = [ratio - COVERING * uncertainty, ratio + COVERING * uncertainty];
  const [low, high] = ends.map((end) => number(end, uncertainty));
  return { of, value: plusMinus(ratio, uncertainty)[0], unit: "", between: `between ${low} and ${high}` };
}

function modulusTexts(modulus) {
  const { value, interval, unit } = modulusOf(modulus);
  if (!modulus) return { value: "–", unit: "", between: "hold on: not known yet" };
  if (unit) {
    const [low, high] = endsOf(interval);
    return { value, unit, between: `between ${low} and ${high}` };
  }
  const { low_MPa: low, high_MPa: high } = modulus;
  const factor = settings.unit === "kPa" ? 1000 : 1;
  if (low > 0 && high === null) return { value: `> ${number(factor * low)}`, unit: settings.unit, between: "stiffer than this probe can tell" };
  if (low === 0 && high > 0) return { value: `< ${number(factor * high)}`, unit: settings.unit, between: "softer than this probe can tell" };
  return { value: "–", unit: "", between: interval };
}

// How wide the number is with its unit, in em of the number: it shrinks to its box, and is never cut.
function widthOf({ value, unit }) {
  const unitWidth = unit ? 0.12 + 0.26 * unit.length : 0;
  return 0.72 * value.length + unitWidth;
}

function capital(text) {
  return text.charAt(0).toUpperCase() + text.slice(1);
}

function withoutStop(title) {
  return title.replace(/\.$/, "");
}
