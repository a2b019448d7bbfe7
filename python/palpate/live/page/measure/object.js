// The object: its whole name, a slot for each touch with its value in it, mean and spread in words; the wizard's steps; the end.

import { $, fill, make, put } from "../dom.js";
import { endsOf, inUnit, modulusOf, plusMinus, sentenceInUnit, settings } from "../formatting.js";
import { running, showsModulus, subject } from "../reading.js";

const MOST_SLOTS = 8; // the newest
const LEAST_SPREAD = 0.1; // %
const STEADY = 0.3; // of the usual scatter
const FEWEST = 3; // specimens of known modulus, for a calibration

export class TouchedObject {
  constructor(known, send) {
    this.known = known;
    this.send = send;
    $("wizardsave").onclick = () => send({ do: "save calibration" });
    $("openreport").onclick = () => this.openReport();
  }

  update(type, known) {
    if (!known.state.now) return;
    if (type === "session" || type === "hello") this.followEnd(known);
    const finished = Boolean(known.finished);
    document.body.classList.toggle("finished", finished);
    $("ending").hidden = !finished;
    put($("endfile").firstChild, known.state.recording ? "End file " : "Record ");
    $("touchslots").hidden = finished;
    this.showHead(finished);
    this.showSlots();
    this.showMean(finished);
    this.showSteps();
    this.showEnd();
  }

  // The card of the end stays until it is left, also while something is touched.
  followEnd(known) {
    const { session } = known;
    if (session.done) {
      // a report from before lacks touches
      if (!known.finished) this.filesBefore = known.state.files?.length ?? 0;
      known.finished = session.done;
    } else if (session.next || !session.specimens.length) known.finished = null;
  }

  showHead(finished) {
    const { session, hello, touches } = this.known;
    const name = objectName(this.known);
    const next = session.next;
    let words = "";
    if (next?.name === name && next.of) words = `touch ${next.nth} of ${next.of}`;
    const modulus = session.specimens.find((one) => one.name === name)?.modulus;
    if (modulus) words = [words, `known: ${inUnit(modulus)} ${settings.unit}`].filter(Boolean).join(" · ");
    if (!name && hello.kind !== "file") words = "no name: P names the specimens";
    const unnamed = hello.kind === "file" ? "No name" : `Touch ${touches.rows.length + (running(this.known.state) || !touchIsShown(this.known) ? 1 : 0)}`;
    const done = session.count?.of ? `${session.count.kept} of ${session.count.of} touches` : "";
    put("objectname", finished ? "All done" : name ?? unnamed);
    put("objectcount", finished ? done : words);
  }

  showSlots() {
    const slots = slotsOf(this.known);
    const amendable = this.known.hello.kind !== "file" || Boolean(this.known.hello.file?.amendable);
    $("touchslots").style.setProperty("--count", Math.max(4, slots.length));
    fill($("touchslots"), [slots, amendable], () => slots.map((slot) => this.slot(slot, amendable)));
  }

  slot({ touch, text, kept, why, here }, amendable) {
    if (!touch) return make("li", { className: here ? "here" : kept ? "done" : "", textContent: text });
    const button = make("button", {
      type: "button",
      title: kept ? "Leave this touch out" : `${why}. Take it back`,
      ariaLabel: `Touch ${touch}, ${text}: ${kept ? "leave it out" : "left out, take it back"}`,
      disabled: !amendable,
      onclick: () => this.send({ do: kept ? "discard" : "keep", touch }),
    });
    button.append(make("span", { className: "glyph", textContent: kept ? "✓ " : "× " }), text);
    return make("li", { className: kept ? "done" : "out" }, button);
  }

  showMean(finished) {
    const { mean, spread, differs } = finished ? outcomeWords(this.known) : meanWords(this.known);
    put("mean", mean);
    put("spread", spread);
    $("objectmean").classList.toggle("bad", differs);
  }

  showSteps() {
    const { calibration } = this.known;
    $("steps").hidden = !calibration.on;
    if (!calibration.on) return;
    const steps = stepsOf(this.known);
    fill($("steps"), steps, () => steps.map(({ words, state, opens }) => {
      const inside = opens ? [make("button", { type: "button", textContent: words, onclick: () => $(opens).click() })] : [words];
      return make("li", { className: state, ariaCurrent: state === "here" ? "step" : null }, ...inside);
    }));
  }

  // The wizard ends in one sentence, and one button.
  showEnd() {
    const { calibration } = this.known;
    const sentence = calibration.on ? endSentence(calibration) : "";
    $("wizardend").hidden = !sentence;
    put($("wizardend").firstChild, sentence);
    const complete = calibration.sound || stepsOf(this.known)[1].state === "done";
    $("wizardsave").hidden = !calibration.on || Boolean(calibration.saved) || !complete;
    $("wizardsave").classList.toggle("strong", Boolean(calibration.sound));
  }

  openReport() {
    const made = this.known.state.files?.slice(this.filesBefore).findLast(({ kind }) => kind === "report");
    if (made) open(`recording/${encodeURIComponent(made.name)}`);
    else $("report").click();
  }
}

function endSentence({ verdict, saved }) {
  if (!verdict) return "";
  return sentenceInUnit(saved ? `${verdict} ${saved}` : verdict);
}

function touchIsShown({ state, touches }) {
  return state.state === "done" && touches.rows.length > 0;
}

// What is touched, was touched just now, or is to be touched next; null: it has no name.
export function objectName(known) {
  const { hello, state, session, touches } = known;
  if (hello.kind === "file") return subject(known)?.specimen ?? null;
  if (running(state)) return state.on ?? null;
  if (touchIsShown(known)) return touches.rows.at(-1).specimen ?? null;
  return session.next?.name || (touches.rows.at(-1)?.specimen ?? null);
}

// A slot for each touch on the object, and for each one that is wanted: { touch, text, kept, why, here }.
export function slotsOf(known) {
  const { session, touches, hello } = known;
  const name = objectName(known);
  const byModulus = showsModulus(known);
  const value = (row) => {
    const [ratio] = plusMinus(row.ratio, row.uncertainty);
    return byModulus ? modulusOf(row.modulus).value : ratio;
  };
  const specimen = session.specimens.find((one) => one.name === name);
  const before = (specimen?.deviations ?? []).filter(({ touch, kept }) => touch === null && kept);
  const slots = before.map(() => ({ touch: null, text: "✓", kept: true }));
  for (const row of touches.rows) {
    if ((row.specimen ?? null) !== name) continue;
    slots.push({ touch: row.number, text: value(row), kept: row.kept !== false, why: row.why });
  }
  const kept = slots.filter((slot) => slot.kept).length;
  const wanted = hello.kind === "file" ? 0 : specimen?.of ?? 0;
  const open = [];
  for (let nth = kept + 1; nth <= wanted && open.length < MOST_SLOTS / 2; nth += 1) {
    open.push({ touch: null, text: String(nth), kept: false, here: nth === kept + 1 });
  }
  return [...slots.slice(open.length - MOST_SLOTS), ...open];
}

// The mean of the touches on the object, and how far they are from each other, in words.
function meanWords(known) {
  const { touches } = known;
  const { together } = touches;
  const nothing = { mean: "", spread: "", differs: false };
  const name = objectName(known);
  if (!together || (touches.rows.at(-1)?.specimen ?? null) !== name || together.touches < 2) return nothing;
  const share = 100 * together.spread;
  const spread = `${share < LEAST_SPREAD ? `below ${LEAST_SPREAD}` : share.toPrecision(2)} % from touch to touch`;
  const usual = `${Number((100 * together.scatter).toPrecision(2))} %`;
  if (!together.agree) {
    return { mean: `▲ These ${together.touches} touches differ`, spread: `${spread}: a hand has ${usual}. Touch again, or leave one out`, differs: true };
  }
  const mean = showsModulus(known) ? modulusMean(together.modulus) : plusMinus(together.ratio, together.standard_error).join(" ");
  return { mean: `Mean ${mean}`, spread: `${spread}: ${together.spread < STEADY * together.scatter ? "less than" : "as"} usual for a hand`, differs: false };
}

function modulusMean(modulus) {
  const { value, interval, unit } = modulusOf(modulus);
  if (!unit) return interval;
  const [low, high] = endsOf(interval);
  return `${value} (${low} to ${high})`;
}

// What a session gave.
function outcomeWords({ finished: done, hello, calibration }) {
  const inside = done.of ? `${done.inside} of ${done.of} known moduli are in their intervals${calibration.saved ? " (fitted to them: no test)" : ""}` : "";
  const source = { assumed: "assumed: too few touches were repeated", calibration: "by the calibration" }[done.source];
  const before = hello.assumed ? `assumed before: ${Number((100 * hello.assumed).toPrecision(2))} %` : "";
  const mean = `Your hand: ± ${(100 * done.scatter).toFixed(1)} % from touch to touch`;
  return { mean, spread: [source ?? before, inside].filter(Boolean).join("; "), differs: false };
}

// Name the specimens, touch each, save: { words, state, opens }.
function stepsOf({ session, calibration }) {
  const known = session.specimens.filter(({ modulus }) => modulus !== null);
  const named = known.length >= FEWEST;
  const done = known.filter(({ kept, of }) => kept >= of).length;
  const touched = named && done === known.length;
  const saved = Boolean(calibration.saved);
  const stateOf = (is, before) => (is ? "done" : before ? "here" : "");
  return [
    { words: named ? `✓ ${known.length} specimens are named` : `1  Name ${FEWEST} specimens or more, with their moduli`, state: stateOf(named, true), opens: named ? null : "openplan" },
    { words: touched ? "✓ All are touched" : `2  Touch each: ${done} of ${known.length} done`, state: stateOf(touched, named) },
    { words: saved ? "✓ In use" : "3  Save", state: stateOf(saved, touched) },
  ];
}
