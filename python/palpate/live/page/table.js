// The table of touches: newest first, the running one on top. A row that is chosen can be assigned, left out or kept. Of
// thousands of rows only those in sight are in the document.

import { $, aligned, arrange, make, put } from "./dom.js";
import { clock, inUnit, modulusOf, places, plusMinus, settings, shoreA, signed } from "./formatting.js";
import { running, truthOf } from "./instruction.js";

const AFTER_S = 2; // a mark so long after a touch is shown beside it
const SPARE = 1000; // px above and below what is in sight
const STEPS = { ArrowDown: 1, ArrowUp: -1, PageDown: 10, PageUp: -10, Home: -Infinity, End: Infinity };

export class Table {
  live = make("tr", { className: "live", hidden: true });

  // say(message): undefined, if nothing can be changed; choose(number of a touch)
  constructor(known, say, choose) {
    Object.assign(this, { known, say, choose, made: new Map(), heights: new Map(), rows: [] });
    $("rows").addEventListener("click", (event) => this.click(event));
    $("rows").addEventListener("keydown", (event) => this.step(event));
    document.addEventListener("scroll", () => this.draw(), { capture: true, passive: true });
    addEventListener("resize", () => this.draw(this.heights.clear()));
    addEventListener("beforeprint", () => this.draw(true));
  }

  update(type) {
    if (["touches", "events", "session", "hello", "chosen", "found"].includes(type)) this.show();
    if (type === "state") this.showRunning();
    if (type === "chosen") this.reveal();
  }

  show() {
    const { touches, found } = this.known, { together } = touches;
    if (this.of !== (found ?? touches)) Object.assign(this, { of: found ?? touches, rows: found ?? touches.rows.toReversed(), widest: widest(touches.rows) });
    const heads = this.known.hello.simulation?.demo ? ["True ratio", "Away"] : ["From mean, %", settings.unit];
    heads.forEach((head, i) => put($("touches").querySelectorAll("th")[4 + i], head));
    $("touches").classList.toggle("unnamed", !this.known.session.specimens.length && !touches.rows.some(({ specimen }) => specimen));
    this.draw();
    put("together", together ? together.text + (together.modulus ? `; if all are on one object (95 % interval): ${inUnit(together.modulus.text)}` : "") : "");
    $("together").hidden = !together;
    $("together").dataset.agree = together?.agree === false ? "no" : "yes";
    this.showRunning();
  }

  // Draws the rows in sight, the one that has the focus and the chosen one; a gap stands for the rows between them.
  draw(all = false, also = null) {
    const place = $("rows"), { chosen, found } = this.known, focused = numberOf(document.activeElement), { top: first } = place.getBoundingClientRect(), box = place.closest(".scroll").getBoundingClientRect();
    const top = Math.max(box.top, 0) - first, bottom = Math.min(box.bottom, innerHeight) - first; // what is in sight, px below the first row
    const most = this.heights.size ? [...this.heights.values()].reduce((sum, px) => sum + px) / this.heights.size : 24, rows = [], shown = [this.live];
    let y = this.live.offsetHeight, gap = 0;
    const close = () => gap && shown.push(make("tr", { className: "gap", ariaHidden: "true", style: `height: ${gap}px` }, make("td")));
    this.rows.forEach((one, at) => {
      const high = this.heights.get(one.number) ?? most, near = y + high > top - SPARE && y < bottom + SPARE;
      y += high;
      if (!all && !near && ![focused, chosen, also].includes(one.number)) return void (gap += high);
      close();
      gap = 0;
      const row = this.same(one, one.number === chosen);
      row.ariaRowIndex = at + 2;
      rows.push(row);
      shown.push(row);
    });
    close();
    if (!rows.length) shown.push(make("tr", {}, make("td", { colSpan: 8, className: "empty", textContent: found ? "No touch is found." : "No touch yet." })));
    place.closest("table").ariaRowCount = this.rows.length + 1;
    this.made = new Map(rows.map((row) => [row.dataset.touch, row]));
    arrange(place, shown);
    for (const row of rows) this.heights.set(Number(row.dataset.touch), row.offsetHeight);
    if (focused && numberOf(document.activeElement) !== focused) this.focus(focused, true);
  }

  focus(number, preventScroll = false) {
    this.made.get(String(number))?.querySelector("button").focus({ preventScroll });
  }

  // The chosen row comes into sight where the table scrolls by itself.
  reveal() {
    const { scrollHeight, clientHeight } = $("rows").closest(".scroll");
    if (scrollHeight > clientHeight) this.made.get(String(this.known.chosen))?.scrollIntoView({ block: "nearest" });
  }

  // By a key from row to row.
  step(event) {
    const from = this.rows.findIndex((one) => one.number === numberOf(event.target)), by = STEPS[event.key];
    if (!by || from < 0 || event.target.closest("select")) return;
    event.preventDefault();
    const to = this.rows[Math.max(0, Math.min(this.rows.length - 1, from + by))];
    this.draw(false, to.number);
    this.focus(to.number);
  }

  // The row that is there, if it would be the same: of thousands of cells only the new ones are made.
  same(one, chosen) {
    const { session, touches } = this.known, names = chosen && session.specimens.map(({ name }) => name);
    const of = JSON.stringify([one, settings, this.widest, remarkOf(one, this.known), names, one.number === touches.most_reliable]), made = this.made.get(String(one.number));
    return made?.of === of ? made : Object.assign(this.row(one, chosen), { of });
  }

  row(one, chosen) {
    const out = one.kept === false, changes = chosen && this.say && (this.known.hello.kind !== "file" || this.known.hello.file.amendable);
    const specimen = changes ? this.picker(one) : one.specimen ?? "", [what, textContent] = out ? ["keep", "Keep"] : ["discard", "Leave out"];
    const buttons = changes ? [make("button", { type: "button", textContent, onclick: () => this.say({ do: what, touch: one.number }) })] : [];
    const row = this.cells(one, specimen, remarkOf(one, this.known), buttons);
    row.dataset.touch = one.number;
    row.className = [out && "out", chosen && "chosen", one.number === this.known.touches.most_reliable && "best"].filter(Boolean).join(" ");
    return row;
  }

  cells(one, specimen, remark, more = []) {
    const { value, interval, shore } = modulusOf(one.modulus), { ratio, modulus } = this.widest, [text, sure] = plusMinus(one.ratio, one.uncertainty);
    const nth = make("button", { type: "button", className: "plain", textContent: one.number, ariaLabel: `Touch ${one.number}: show it` });
    const away = one.deviation === null || one.deviation === undefined ? "–" : signed(100 * one.deviation, 1);
    const { hello } = this.known, demo = hello.simulation?.demo, truth = demo && truthOf(hello, one)?.ratio;
    const [mean, last] = demo ? [truth?.toFixed(2) ?? "–", truth ? `${signed(100 * (one.ratio / truth - 1), 1)} %` : "–"] : [aligned(away, 1), aligned(value, modulus)];
    return make("tr", {},
      make("td", {}, nth), make("td", { className: "begin", textContent: this.known.found ? clock(one.start_s - (this.known.hello.origin_s ?? 0)) : "" }), make("td", { className: "name" }, specimen),
      make("td", { className: "num", title: one.uncertainty_from ?? "" }, aligned(text, ratio), make("span", { className: "opt", textContent: ` ${sure}` })),
      make("td", {}, mean),
      make("td", { className: "num" }, last, ...(shore ? [make("span", { className: "opt", textContent: ` · ${shore}` })] : [])),
      make("td", { className: "opt", textContent: interval.replace(/ [kM]Pa$/, "") }), make("td", { className: "name" }, ...more, ...(remark ? [make("div", { className: "remark", textContent: remark, title: remark })] : [])));
  }

  showRunning() {
    const { state, touches, session, hello } = this.known, on = running(state) && state.now?.tone !== "fault" && !this.known.offline;
    this.live.hidden = !on;
    if (!on) return;
    const seconds = state.now?.share && hello.seconds ? `, ${(state.now.share * hello.seconds).toFixed(1)} s` : "";
    const mean = session.specimens.find(({ name }) => name === state.on)?.mean;
    const one = { ...state, number: (touches.rows.at(-1)?.number ?? 0) + 1, deviation: mean ? state.ratio / mean - 1 : null };
    this.live.replaceChildren(...this.cells(one, state.on ?? "", `measuring${seconds}`).cells);
    this.live.cells[0].textContent = one.number;
  }

  picker(one) {
    const names = ["", ...this.known.session.specimens.map(({ name }) => name)];
    const options = names.map((name) => new Option(name || "none", name, false, name === (one.specimen ?? "")));
    const onchange = ({ target }) => this.say({ do: "assign", touch: one.number, name: target.value });
    return make("select", { onchange, ariaLabel: `Specimen of touch ${one.number}` }, ...options);
  }

  click(event) {
    const row = event.target.closest("tr"), touch = Number(row?.dataset.touch);
    if (!touch || event.target.closest("select, option, td:last-child button")) return;
    this.choose(touch === this.known.chosen ? null : touch);
  }
}

export function remarkOf(one, { events, touches, found }) {
  if (one.kept === false) return `▲ left out. ${one.why || one.advice.join(". ")}`;
  const marks = events.marks.filter(({ t_s: t, text }) => text && t > one.start_s && t < one.end_s + AFTER_S).map(({ text }) => text);
  const best = one.number === touches.most_reliable ? ["most reliable"] : [];
  return [...best, ...one.advice, one.modulus?.extrapolated ? "beyond the calibration" : "", one.revised && !found ? "revised" : "", ...marks].filter(Boolean).join(". ");
}

function numberOf(element) {
  return Number(element?.closest?.("#rows tr")?.dataset.touch) || null;
}

// All touches, by a message with those that have changed, the number of all, and what each touch changes in all of them.
export function merged(before, { rows, count = rows.length, scatter, means = {}, ...more }) {
  const all = before.slice(0, count);
  for (const row of rows) all[row.number - 1] = row;
  for (const one of all) {
    const mean = means[one.specimen];
    one.deviation = mean && one.ratio !== null ? one.ratio / mean - 1 : null;
    if (scatter) Object.assign(one, { uncertainty: one.own_error === null ? null : Math.hypot(one.own_error, scatter.share * one.ratio), uncertainty_from: scatter.source });
  }
  return { rows: all, ...more };
}

function widest(rows) {
  const most = (text) => Math.max(0, ...rows.map((one) => places(text(one))));
  return { ratio: most((one) => plusMinus(one.ratio, one.uncertainty)[0]), modulus: most((one) => modulusOf(one.modulus).value) };
}

// The table of touches as text: with all digits, for a spreadsheet; moduli in the unit that is set.
const NUMBERS = ["specimen", "start_s", "end_s", "samples", "ratio", "standard_error", "uncertainty", "uncertainty_from", "covariance", "alarm_share"];
const columns = () => [
  ["touch", (one) => one.number], ...NUMBERS.map((name) => [name, (one) => one[name]]),
  ...["value", "low", "high"].map((name) => [`${name === "value" ? "modulus" : name}_${settings.unit}`, ({ modulus }) => inUnit(modulus?.[`${name}_MPa`] ?? "")]),
  ...(settings.shore === "on" ? [["shore_A", ({ modulus }) => shoreA(modulus?.value_MPa ?? null)]] : []),
  ["deviation", (one) => one.deviation], ["kept", (one) => (one.kept === false ? "no" : "yes")], ["flags", (one) => one.flags.join(" ")],
  ["remark", (one) => one.why || one.advice.join(". ")],
];

export function asText(rows, separator) {
  const cell = (value) => quoted(String(value ?? ""), separator);
  const all = columns();
  return [all.map(([name]) => name), ...rows.map((one) => all.map(([, of]) => of(one)))]
    .map((line) => line.map(cell).join(separator) + "\r\n").join("");
}

export function save(rows, name) {
  const address = URL.createObjectURL(new Blob([asText(rows, ",")], { type: "text/csv" }));
  make("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 1000);
}

// A spreadsheet would run a text that begins so as a formula.
function quoted(text, separator) {
  const safe = /^[=+\-@\t\r]/.test(text) && Number.isNaN(Number(text)) ? `'${text}` : text;
  return safe.includes(separator) || /["\r\n]/.test(safe) ? `"${safe.replaceAll('"', '""')}"` : safe;
}
