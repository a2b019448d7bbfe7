// The touches of a file that are found: list, dots, statistics, and what is saved and named, are always these.

import { $, fill, make, put } from "./dom.js";
import { clock, grouped, number, plusMinus } from "./formatting.js";
import { remarkOf, save } from "./table.js";

const MOST = 4000;
const HOUR_S = 3600;
const RATIO =
  /^(\d+(?:[.,]\d+)?)\s*[-–]\s*(\d+(?:[.,]\d+)?)$|^>\s*(\d+(?:[.,]\d+)?)$|^<\s*(\d+(?:[.,]\d+)?)$/;
const CHIPS = {
  "left out": ({ kept }) => !kept,
  flagged: ({ flags }) => flags.length > 0,
  "no name": ({ specimen }) => !specimen,
};

export class TouchFinder {
  // shell: Shell; send(message): to the server; answer(text, bad)
  constructor(shell, send, answer) {
    Object.assign(this, { known: shell.known, charts: shell.charts, shell, send, answer });
    this.charts.find = (from, to) => this.findTimes(from, to);
    $("find").oninput = () => this.show();
    $("find").onkeydown = (event) => {
      if (event.key !== "Escape" || !$("find").value) return;
      event.stopPropagation();
      this.look(this.words.slice(0, -1));
    };
    $("time").onchange = () => this.go($("time").value.trim());
    $("before").onclick = () => this.step(-1);
    $("after").onclick = () => this.step(1);
    $("savefound").onclick = () => {
      const name = this.known.hello.file.name.replace(/\.[^.]*$/, "");
      save(this.known.found, `${name}-touches.csv`);
    };
    $("naming").onsubmit = (event) => {
      event.preventDefault();
      this.name();
    };
  }

  get origin() {
    return this.known.hello.origin_s ?? 0;
  }

  // Whether 3:00 is three hours: in a recording of an hour or more.
  get long() {
    return this.charts.viewport.end - this.charts.viewport.begin >= HOUR_S;
  }

  // A decimal comma has no space behind it.
  get words() {
    const parts = $("find").value.split(/;|,\s/);
    return parts.map((word) => word.trim()).filter(Boolean);
  }

  look(words) {
    $("find").value = words.join("; ");
    this.show();
  }

  // A part of the strip was selected: it takes the place of the times that were typed.
  findTimes(from, to) {
    const others = this.words.filter((word) => !(this.times(word)[0] >= 0));
    this.look([...others, this.timed(from - this.origin, to - this.origin)]);
  }

  update(type, { hello, touches, session }) {
    if (!["hello", "touches", "events"].includes(type)) return;
    if (hello.measurement !== this.measurement) $("find").value = ""; // another recording
    this.measurement = hello.measurement;
    const file = hello.kind === "file";
    for (const id of ["finder", "step", "going"]) $(id).hidden = !file;
    if (!file) {
      this.known.found = undefined;
      return;
    }
    $("naming").hidden = !hello.file.amendable;
    fill($("names"), session.specimens, () =>
      session.specimens.map(({ name }) => make("option", { value: name })),
    );
    const counts = Object.entries(CHIPS).map(([word, holds]) => {
      return [word, touches.rows.filter(holds).length];
    });
    fill($("chips"), counts, () => counts.map(([word, count]) => this.chip(word, count)));
    this.select();
  }

  chip(word, count) {
    const textContent = `${word} ${grouped(count)}`;
    const onclick = () => this.look([...this.words, word]);
    return make("button", { type: "button", textContent, disabled: !count, onclick });
  }

  show() {
    this.select();
    this.shell.update("found");
    this.charts.redraw("time");
  }

  select() {
    const { known } = this;
    const all = known.touches.rows;
    const tests = this.words.map((word) => this.condition(word.toLowerCase()));
    known.found = all.filter((one) => tests.every((holds) => holds(one)));
    const count = known.found.length;
    const used = known.found.filter(({ kept, ratio }) => kept && ratio !== null);
    const wrong = this.words.find((word) => /^[<>]/.test(word) && !RATIO.test(word));
    const counted = ` of ${grouped(all.length)} found · ${grouped(used.length)} count`;
    const allowed = ` found. Got ${wrong}, allowed: a ratio, as >8 or <4.4`;
    put($("foundcount").firstChild, grouped(count));
    put($("foundcount").children[1], wrong ? allowed : counted);
    put("savefound", `Save ${grouped(count)} as CSV`);
    put($("naming").lastChild, `Name ${grouped(count)}`);
    $("savefound").disabled = !count;
    $("naming").lastChild.disabled = !count;
    const lines = statistics(used);
    fill($("statistics"), lines, () =>
      lines.flatMap(([name, text]) => [
        make("dt", { textContent: name }),
        make("dd", { textContent: text }),
      ]),
    );
  }

  // A part as a word, and back: [from, to], s from the beginning; NaN: it is none.
  timed(from, to) {
    const written = (s) => {
      const hours = this.long ? `${Math.floor(s / HOUR_S)}:` : "";
      return `${hours}${clock(s % HOUR_S)}`;
    };
    return `${written(Math.floor(Math.max(0, from)))}-${written(Math.ceil(to))}`;
  }

  times(word) {
    const parts = word.split(/[-–]/).map((part) => (part.includes(":") ? this.seconds(part) : NaN));
    return parts.length === 2 ? parts : [NaN, NaN];
  }

  // 3:41:41, 41:41 or 41.5; in a long recording 3:41 is hours and minutes, if it is that long.
  seconds(text) {
    const parts = text.split(":").map((part) => {
      return /^\s*\d+([.,]\d+)?\s*$/.test(part) ? Number(part.replace(",", ".")) : NaN;
    });
    const { begin, end } = this.charts.viewport;
    const within = 3600 * parts[0] + 60 * parts[1] <= end - begin;
    if (parts.length === 2 && this.long && within) parts.push(0);
    return parts.length > 3 ? NaN : parts.reduce((sum, part) => 60 * sum + part, 0);
  }

  // What a word asks of a touch.
  condition(word) {
    const named = ({ specimen }) => specimen?.toLowerCase() === word;
    if (this.known.touches.rows.some(named)) return named;
    const [from, to] = this.times(word);
    if (to >= from) return ({ start_s: t }) => t - this.origin >= from && t - this.origin <= to;
    const range = word.match(RATIO);
    if (range) return withinRange(...range);
    if (/^#\d+$/.test(word)) return ({ number: n }) => `#${n}` === word;
    if (Object.hasOwn(CHIPS, word)) return CHIPS[word];
    return (one) => {
      const text = `${one.specimen ?? ""} ${remarkOf(one, this.known)}`;
      return one.flags.includes(word) || text.toLowerCase().includes(word);
    };
  }

  // The next touch that is found, or the one before.
  step(by) {
    const { chosen, found } = this.known;
    const after = ({ number: n }) => n > (chosen ?? 0);
    const before = ({ number: n }) => n < (chosen ?? Infinity);
    const next = by > 0 ? found.find(after) : found.findLast(before);
    if (next) this.charts.choose(next.number);
    else if (!found.length) this.answer("No touch is found.");
    else this.answer(`This is the ${by > 0 ? "last" : "first"} touch found.`);
  }

  // One time moves everything: the window goes there, and the touch there or the nearest one is shown.
  go(text) {
    if (!text) return;
    const { end } = this.charts.viewport;
    const t = this.seconds(text) + this.origin;
    if (!(t <= end)) {
      const allowed = `a time up to ${clock(end - this.origin)}, as 3:41:41, 41:41 or 41.5`;
      this.answer(`Go to: got ${text}, allowed: ${allowed}`, true);
      return;
    }
    $("time").blur();
    const touch = this.charts.annotations.nearestTo(t);
    const moment = { start_s: t, end_s: t };
    if (!touch) {
      this.charts.viewport.around(moment);
      return;
    }
    this.charts.choose(touch.number, moment);
    const away = Math.max(touch.start_s - t, t - touch.end_s);
    if (away <= 0) return;
    const side = touch.start_s > t ? "later" : "earlier";
    this.answer(`No touch then. Touch ${touch.number}, ${away.toFixed(0)} s ${side}, is shown.`);
  }

  // In messages of at most `MOST` touches.
  name() {
    const numbers = this.known.found.map(({ number: n }) => n);
    const text = $("name").value.trim();
    for (let i = 0; i < numbers.length; i += MOST) {
      this.send({ do: "name", touches: numbers.slice(i, i + MOST), text });
    }
  }
}

// Whether the ratio of a touch is in a range, by the groups of RATIO.
function withinRange(_, low, high, above, below) {
  const value = (text, other) => (text ? Number(text.replace(",", ".")) : other);
  const from = value(low ?? above, -Infinity);
  const to = value(high ?? below, Infinity);
  return ({ ratio }) => ratio !== null && ratio >= from && ratio <= to;
}

// Of two touches or more: mean and standard deviation; over an hour or more the rise in an hour with its error. The line
// below the table says whether touches agree, and how well their mean is known.
function statistics(touches) {
  const n = touches.length;
  if (n < 2) {
    return touches.map((one) => ["Ratio", plusMinus(one.ratio, one.uncertainty).join(" ")]);
  }
  const sum = (value) => touches.reduce((all, one) => all + value(one), 0);
  const mean = sum(({ ratio }) => ratio) / n;
  const spread = Math.sqrt(sum(({ ratio }) => (ratio - mean) ** 2) / (n - 1));
  const percent = (100 * spread) / Math.abs(mean);
  const lines = [
    ["Mean", number(mean, spread)],
    ["s.d.", `${number(spread, spread)}, ${number(percent, percent)} %`],
  ];
  const times = touches.map(({ start_s: t }) => t);
  if (n < 3 || Math.max(...times) - Math.min(...times) < HOUR_S) return lines;
  const middle = sum(({ start_s: t }) => t) / n;
  const square = sum(({ start_s: t }) => (t - middle) ** 2);
  const rise = sum(({ start_s: t, ratio }) => (t - middle) * (ratio - mean)) / square;
  const rest = ({ start_s: t, ratio }) => (ratio - mean - rise * (t - middle)) ** 2;
  const error = Math.sqrt(sum(rest) / (n - 2) / square);
  const hourly = (100 * HOUR_S) / Math.abs(mean);
  const [slope, sure] = plusMinus(rise * hourly, error * hourly);
  const signedSlope = rise < 0 ? slope.replace("-", "−") : `+${slope}`;
  const trend = Math.abs(rise) > 2 * error ? "" : ": no trend";
  return [...lines, ["Slope", `${signedSlope} ${sure} % an hour${trend}`]];
}
