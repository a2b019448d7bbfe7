// The table of touches: newest first, the running one on top. A row that is chosen can be assigned, left out or kept.

import { $, make, put } from "./dom.js";
import { aligned, modulusOf, number, places, signed } from "./formatting.js";
import { running } from "./now.js";

const AFTER_S = 2; // a mark so long after a touch is said beside it

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
    const live = document.createElement("tr"), none = make("tr", {}, make("td", { colSpan: 7, className: "empty", textContent: "No touch yet." }));
    live.className = "live";
    this.live = live;
    const rows = touches.rows.toReversed().map((one) => this.same(one, one.number === chosen));
    this.made = new Map(rows.map((row) => [row.dataset.touch, row]));
    $("rows").replaceChildren(live, ...(rows.length ? rows : [none]));
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
    row.classList.toggle("out", out);
    row.classList.toggle("chosen", chosen);
    row.classList.toggle("best", one.number === this.known.touches.most_reliable);
    return row;
  }

  cells(one, specimen, remark, more = []) {
    const { value, interval } = modulusOf(one.modulus), { ratio, deviation, modulus } = this.widest;
    const nth = make("button", { type: "button", className: "plain", textContent: one.number });
    nth.setAttribute("aria-label", `Touch ${one.number}: show it`);
    const away = one.deviation === null || one.deviation === undefined ? "–" : signed(100 * one.deviation, 1);
    const cells = [
      make("td", {}, nth), make("td", { className: "name" }, specimen),
      make("td", { className: "num" }, aligned(number(one.ratio, one.uncertainty ?? one.standard_error), ratio)),
      make("td", {}, aligned(away, deviation)),
      make("td", { className: "num" }, aligned(value, modulus)),
      make("td", { className: "opt", textContent: interval.replace(/ MPa$/, "") }), make("td", { className: "name" }, ...more, ...(remark ? [make("div", { className: "remark", textContent: remark, title: remark })] : [])),
    ];
    return make("tr", {}, ...cells);
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
    const picker = make("select", { onchange: () => this.say({ do: "assign", touch: one.number, name: picker.value }) }, ...options);
    picker.setAttribute("aria-label", `Specimen of touch ${one.number}`);
    return picker;
  }

  button(one) {
    const what = one.kept === false ? "keep" : "discard";
    return make("button", { type: "button", textContent: one.kept === false ? "Keep" : "Leave out", onclick: () => this.say({ do: what, touch: one.number }) });
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
    ratio: most(rows.map((one) => number(one.ratio, one.uncertainty ?? one.standard_error))),
    modulus: most(rows.map((one) => modulusOf(one.modulus).value)),
    deviation: 1,
  };
}
