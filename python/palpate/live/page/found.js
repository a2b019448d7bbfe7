// The touches of a file that are found: list, dots, statistics, and what is saved and named, are always these.

import { $, fill, make, put } from "./dom.js";
import { clock, grouped, number, plusMinus } from "./formatting.js";
import { remarkOf, save } from "./table.js";

const MOST = 4000, HOUR_S = 3600;
const RATIO = /^(\d+(?:[.,]\d+)?)\s*[-–]\s*(\d+(?:[.,]\d+)?)$|^>\s*(\d+(?:[.,]\d+)?)$|^<\s*(\d+(?:[.,]\d+)?)$/;
const CHIPS = { "left out": ({ kept }) => !kept, flagged: ({ flags }) => flags.length > 0, "no name": ({ specimen }) => !specimen };

export class Found {
  // screen: Screen; say(message): to the server; answer(text, bad)
  constructor(screen, say, answer) {
    Object.assign(this, { known: screen.known, charts: screen.charts, screen, say, answer });
    this.charts.find = (from, to) => this.look([...this.words.filter((word) => !(this.times(word)[0] >= 0)), this.timed(from - this.origin, to - this.origin)]);
    $("find").oninput = () => this.show();
    $("find").onkeydown = (event) => {
      if (event.key === "Escape" && $("find").value) event.stopPropagation(this.look(this.words.slice(0, -1)));
    };
    $("time").onchange = () => this.go($("time").value.trim());
    $("before").onclick = () => this.step(-1);
    $("after").onclick = () => this.step(1);
    $("savefound").onclick = () => save(this.known.found, `${this.known.hello.file.name.replace(/\.[^.]*$/, "")}-touches.csv`);
    $("naming").onsubmit = (event) => event.preventDefault(this.name());
  }

  get origin() {
    return this.known.hello.origin_s ?? 0;
  }

  // Whether 3:00 is three hours: in a recording of an hour or more.
  get long() {
    return this.charts.window.end - this.charts.window.begin >= HOUR_S;
  }

  // A decimal comma has no space behind it.
  get words() {
    return $("find").value.split(/;|,\s/).map((word) => word.trim()).filter(Boolean);
  }

  look(words) {
    $("find").value = words.join("; ");
    this.show();
  }

  update(type, { hello, touches, session }) {
    const file = hello.kind === "file", counts = Object.entries(CHIPS).map(([word, holds]) => [word, touches.rows.filter(holds).length]);
    if (!["hello", "touches", "events"].includes(type)) return;
    for (const id of ["finder", "step", "going"]) $(id).hidden = !file;
    if (!file) return void (this.known.found = undefined);
    $("naming").hidden = !hello.file.amendable;
    fill($("names"), session.specimens, () => session.specimens.map(({ name }) => make("option", { value: name })));
    fill($("chips"), counts, () => counts.map(([word, count]) => make("button", { type: "button", textContent: `${word} ${grouped(count)}`, disabled: !count, onclick: () => this.look([...this.words, word]) })));
    this.select();
  }

  show() {
    this.select();
    this.screen.update("found");
    this.charts.redraw("time");
  }

  select() {
    const { known } = this, all = known.touches.rows, tests = this.words.map((word) => this.condition(word.toLowerCase()));
    known.found = all.filter((one) => tests.every((holds) => holds(one)));
    const count = known.found.length, used = known.found.filter(({ kept, ratio }) => kept && ratio !== null), lines = statistics(used);
    put($("foundcount").firstChild, grouped(count));
    const wrong = this.words.find((word) => /^[<>]/.test(word) && !RATIO.test(word));
    put($("foundcount").children[1], wrong ? ` found. Got ${wrong}, allowed: a ratio, as >8 or <4.4` : ` of ${grouped(all.length)} found · ${grouped(used.length)} count`);
    put("savefound", `Save ${grouped(count)} as CSV`);
    put($("naming").lastChild, `Name ${grouped(count)}`);
    $("savefound").disabled = $("naming").lastChild.disabled = !count;
    fill($("statistics"), lines, () => lines.flatMap(([name, text]) => [make("dt", { textContent: name }), make("dd", { textContent: text })]));
  }

  // A part as a word, and back: [from, to], s from the begin; NaN: it is none.
  timed(from, to) {
    return [Math.floor(Math.max(0, from)), Math.ceil(to)].map((s) => `${this.long ? `${Math.floor(s / HOUR_S)}:` : ""}${clock(s % HOUR_S)}`).join("-");
  }

  times(word) {
    const parts = word.split(/[-–]/).map((part) => (part.includes(":") ? this.seconds(part) : NaN));
    return parts.length === 2 ? parts : [NaN, NaN];
  }

  // 3:41:41, 41:41 or 41.5; in a long recording 3:41 is hours and minutes, if it has so many.
  seconds(text) {
    const parts = text.split(":").map((part) => (/^\s*\d+([.,]\d+)?\s*$/.test(part) ? Number(part.replace(",", ".")) : NaN));
    const { begin, end } = this.charts.window, within = 3600 * parts[0] + 60 * parts[1] <= end - begin;
    if (parts.length === 2 && this.long && within) parts.push(0);
    return parts.length > 3 ? NaN : parts.reduce((sum, part) => 60 * sum + part, 0);
  }

  // What a word asks of a touch.
  condition(word) {
    const named = ({ specimen }) => specimen?.toLowerCase() === word;
    if (this.known.touches.rows.some(named)) return named;
    const [from, to] = this.times(word), value = (text, other) => (text ? Number(text.replace(",", ".")) : other);
    const [range, low, high, above, below] = word.match(RATIO) ?? [];
    if (to >= from) return ({ start_s: t }) => t - this.origin >= from && t - this.origin <= to;
    if (range) return ({ ratio }) => ratio !== null && ratio >= value(low ?? above, -Infinity) && ratio <= value(high ?? below, Infinity);
    if (/^#\d+$/.test(word)) return ({ number: n }) => `#${n}` === word;
    if (Object.hasOwn(CHIPS, word)) return CHIPS[word];
    return ((one) => one.flags.includes(word) || `${one.specimen ?? ""} ${remarkOf(one, this.known)}`.toLowerCase().includes(word));
  }

  // The next touch that is found, or the one before.
  step(by) {
    const { chosen, found } = this.known, next = by > 0 ? found.find(({ number: n }) => n > (chosen ?? 0)) : found.findLast(({ number: n }) => n < (chosen ?? Infinity));
    if (next) this.charts.choose(next.number);
    else this.answer(found.length ? `This is the ${by > 0 ? "last" : "first"} touch found.` : "No touch is found.");
  }

  go(text) {
    const t = this.seconds(text) + this.origin, touch = this.charts.tale.touchAt(t), { end } = this.charts.window;
    if (!(t <= end)) return this.answer(`Go to: got ${text}, allowed: a time up to ${clock(end - this.origin)}, as 3:41:41, 41:41 or 41.5`, true);
    $("time").blur();
    if (touch) this.charts.choose(touch.number);
    this.charts.window.around({ start_s: t, end_s: t });
  }

  // In messages of so many touches.
  name() {
    const numbers = this.known.found.map(({ number: n }) => n);
    for (let i = 0; i < numbers.length; i += MOST) this.say({ do: "name", touches: numbers.slice(i, i + MOST), text: $("name").value.trim() });
  }
}

// Of two touches or more: mean, standard deviation, and rise in an hour with its error, if three or more have one.
function statistics(touches) {
  const n = touches.length, sum = (value) => touches.reduce((all, one) => all + value(one), 0);
  if (n < 2) return touches.map(({ ratio, uncertainty }) => ["Ratio", plusMinus(ratio, uncertainty).join(" ")]);
  const mean = sum(({ ratio }) => ratio) / n, middle = sum(({ start_s: t }) => t) / n, square = sum(({ start_s: t }) => (t - middle) ** 2);
  const spread = Math.sqrt(sum(({ ratio }) => (ratio - mean) ** 2) / (n - 1)), rise = sum(({ start_s: t, ratio }) => (t - middle) * (ratio - mean)) / square;
  const error = Math.sqrt(sum(({ start_s: t, ratio }) => (ratio - mean - rise * (t - middle)) ** 2) / (n - 2) / square);
  const hourly = (100 * HOUR_S) / Math.abs(mean), [slope, sure] = plusMinus(rise * hourly, error * hourly);
  const known = [["Mean", plusMinus(mean, spread / Math.sqrt(n)).join(" ")], ["s.d.", `${number(spread)}, ${number((100 * spread) / Math.abs(mean))} %`]];
  if (Number.isFinite(error)) known.push(["Slope", `${rise < 0 ? slope.replace("-", "−") : `+${slope}`} ${sure} % an hour${Math.abs(rise) > 2 * error ? "" : ": no trend"}`]);
  return known;
}
