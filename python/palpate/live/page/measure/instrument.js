// The instrument: what to do and why, the number with its interval in words, or what mends a fault.

import { measure } from "../charts/svg.js";
import { $, put } from "../dom.js";
import { sentenceInUnit } from "../formatting.js";
import { fileWords, readingOf, subject } from "../reading.js";

const ALARMED = ["fault", "caution"];
const WHOLE = 100; // length of the ring
const EM = 12; // px of a text that is measured
const UNIT_SIZE = 0.34; // of the number's
const UNIT_GAP = 0.09; // em
const TIGHT = 0.02; // em between two letters

// What a button can mend: key of the line -> id of the button that does it.
const MENDS = { baseline: "tare", touched: "tare", range: "centre", "at its end": "centre", ended: "again" };

export class Instrument {
  constructor() {
    $("remedydo").onclick = () => $(this.mend).click();
  }

  update(type, known) {
    if (!known.state.now) return;
    const { now, line } = wordsOf(known);
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
    put("remedywhy", sentenceInUnit(line.text));
    const mendable = now.tone === "fault" || line.what === "touched";
    this.mend = mendable ? MENDS[line.what] : null;
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

function wordsOf(known) {
  const { hello, state, touches } = known;
  if (known.offline) return offlineWords(known);
  if (hello.kind === "file" && touches.rows.length) return { now: fileWords(known), line: state.line };
  return state;
}

function offlineWords({ offline: since }) {
  const line = { what: "offline", title: "No connection.", text: `The last data is from ${since}. Look at the terminal of palpate.` };
  return { now: { word: "Offline", sub: "the page tries again by itself", tone: "fault", share: null }, line };
}

// How wide the number is with its unit, in em of the number: it shrinks to its box, and is never cut.
function widthOf({ value, unit }) {
  const wide = measure(value, 1) / EM - TIGHT * value.length;
  return unit ? wide + UNIT_GAP + (UNIT_SIZE * measure(unit, 1)) / EM : wide;
}

function capital(text) {
  return text.charAt(0).toUpperCase() + text.slice(1);
}

function withoutStop(title) {
  return title.replace(/\.$/, "");
}
