// The table of touches: newest first, the running one on top. A row that is chosen can be assigned, left out or kept.

import { $, aligned, make, put } from "./dom.js";
import { modulusOf, places, plusMinus, signed } from "./formatting.js";
import { running } from "./now.js";

const AFTER_S = 2; // a mark so long after a touch is shown beside it

export class Table {
  // say(message): null, if nothing can be changed; choose(number of a touch)
  constructor(say, choose) {
    Object.assign(this, { say, choose, made: new Map() });
    $("rows").addEventListener("click", (event) => this.click(event));
  }

  tell(type, known) {
    this.known = known;
    if (["touches", "events", "session", "hello", "chosen"].includes(type)) this.show();
    if (type === "state") this.showRunning();
  }

  show() {
    const { touches, chosen } = this.known;
    this.widest = widest(touches.rows);
    const none = make("tr", {}, make("td", { colSpan: 7, className: "empty", textContent: "No touch yet." }));
    this.live = make("tr", { className: "live" });
    const rows = touches.rows.toReversed().map((one) => this.same(one, one.number === chosen));
    this.made = new Map(rows.map((row) => [row.dataset.touch, row]));
    $("rows").replaceChildren(this.live, ...(rows.length ? rows : [none]));
    const { together } = touches;
    put("together", together ? together.text + (together.modulus ? `, if all are on one object: ${together.modulus.text}` : "") : "");
    $("together").hidden = !together;
    $("together").dataset.agree = together?.agree === false ? "no" : "yes";
    this.showRunning();
  }

  // The row that is there, if it would be the same: of thousands of cells only the new ones are made.
  same(one, chosen) {
    const { session, touches } = this.known, names = chosen && session.specimens.map(({ name }) => name);
    const of = JSON.stringify([one, this.widest, this.remark(one), names, one.number === touches.most_reliable]), made = this.made.get(String(one.number));
    return made?.of === of ? made : Object.assign(this.row(one, chosen), { of });
  }

  row(one, chosen) {
    const out = one.kept === false, changes = chosen && this.say && this.known.hello.kind !== "file";
    const specimen = changes ? this.picker(one) : one.specimen ?? "";
    const row = this.cells(one, specimen, this.remark(one), changes ? [this.button(one)] : []);
    row.dataset.touch = one.number;
    row.className = [out && "out", chosen && "chosen", one.number === this.known.touches.most_reliable && "best"].filter(Boolean).join(" ");
    return row;
  }

  cells(one, specimen, remark, more = []) {
    const { value, interval } = modulusOf(one.modulus), { ratio, deviation, modulus } = this.widest, [text, sure] = plusMinus(one.ratio, one.uncertainty);
    const nth = make("button", { type: "button", className: "plain", textContent: one.number, ariaLabel: `Touch ${one.number}: show it` });
    const away = one.deviation === null || one.deviation === undefined ? "–" : signed(100 * one.deviation, 1);
    return make("tr", {},
      make("td", {}, nth), make("td", { className: "name" }, specimen),
      make("td", { className: "num", title: one.uncertainty_from ?? "" }, aligned(text, ratio), make("span", { className: "opt", textContent: ` ${sure}` })),
      make("td", {}, aligned(away, deviation)),
      make("td", { className: "num" }, aligned(value, modulus)),
      make("td", { className: "opt", textContent: interval.replace(/ MPa$/, "") }), make("td", { className: "name" }, ...more, ...(remark ? [make("div", { className: "remark", textContent: remark, title: remark })] : [])));
  }

  remark(one) {
    if (one.kept === false) return `▲ left out. ${one.why || one.advice.join(". ")}`;
    const { events, touches } = this.known;
    const marks = events.marks.filter(({ t_s: t, text }) => text && t > one.start_s && t < one.end_s + AFTER_S).map(({ text }) => text);
    const best = one.number === touches.most_reliable ? ["most reliable"] : [];
    return [...best, ...one.advice, one.revised ? "revised" : "", ...marks].filter(Boolean).join(". ");
  }

  showRunning() {
    const { state, touches, session, hello } = this.known, on = running(state) && state.now?.tone !== "fault";
    if (!this.live) return;
    this.live.hidden = !on;
    if (!on) return;
    const seconds = state.now?.share && hello.seconds ? `, ${(state.now.share * hello.seconds).toFixed(1)} s` : "";
    const one = { ...state, number: (touches.rows.at(-1)?.number ?? 0) + 1, deviation: away(state.ratio, session) };
    this.live.replaceChildren(...this.cells(one, session.next?.name ?? "", `measuring${seconds}`).cells);
    this.live.cells[0].textContent = one.number;
  }

  picker(one) {
    const names = ["", ...this.known.session.specimens.map(({ name }) => name)];
    const options = names.map((name) => make("option", { value: name, textContent: name || "none", selected: name === (one.specimen ?? "") }));
    const onchange = ({ target }) => this.say({ do: "assign", touch: one.number, name: target.value });
    return make("select", { onchange, ariaLabel: `Specimen of touch ${one.number}` }, ...options);
  }

  button(one) {
    const [what, textContent] = one.kept === false ? ["keep", "Keep"] : ["discard", "Leave out"];
    return make("button", { type: "button", textContent, onclick: () => this.say({ do: what, touch: one.number }) });
  }

  click(event) {
    const row = event.target.closest("tr"), touch = Number(row?.dataset.touch);
    if (!touch || event.target.closest("select, option, td:last-child button")) return;
    this.choose(touch === this.known.chosen ? null : touch);
  }
}

function away(ratio, { next, specimens }) {
  const mean = specimens.find(({ name }) => name === next?.name)?.mean;
  return mean && ratio ? ratio / mean - 1 : null;
}

function widest(rows) {
  const most = (texts) => Math.max(0, ...texts.map(places));
  return {
    ratio: most(rows.map((one) => plusMinus(one.ratio, one.uncertainty)[0])),
    modulus: most(rows.map((one) => modulusOf(one.modulus).value)),
    deviation: 1,
  };
}

// The table of touches as text: with all digits, for a spreadsheet.
const COLUMNS = [
  ["touch", (one) => one.number], ["specimen", (one) => one.specimen ?? ""], ["start_s", (one) => one.start_s], ["end_s", (one) => one.end_s],
  ["samples", (one) => one.samples], ["ratio", (one) => one.ratio], ["standard_error", (one) => one.standard_error],
  ["uncertainty", (one) => one.uncertainty], ["uncertainty_from", (one) => one.uncertainty_from], ["covariance", (one) => one.covariance], ["alarm_share", (one) => one.alarm_share],
  ["modulus_MPa", (one) => one.modulus?.value_MPa], ["low_MPa", (one) => one.modulus?.low_MPa], ["high_MPa", (one) => one.modulus?.high_MPa],
  ["deviation", (one) => one.deviation], ["kept", (one) => (one.kept === false ? "no" : "yes")], ["flags", (one) => one.flags.join(" ")],
  ["remark", (one) => one.why || one.advice.join(". ")],
];

export function asText(rows, separator) {
  const cell = (value) => quoted(String(value ?? ""), separator);
  return [COLUMNS.map(([name]) => name), ...rows.map((one) => COLUMNS.map(([, of]) => of(one)))]
    .map((line) => line.map(cell).join(separator) + "\r\n").join("");
}

// A spreadsheet would run a text that begins so as a formula.
function quoted(text, separator) {
  const safe = /^[=+\-@\t\r]/.test(text) && Number.isNaN(Number(text)) ? `'${text}` : text;
  return safe.includes(separator) || /["\r\n]/.test(safe) ? `"${safe.replaceAll('"', '""')}"` : safe;
}
