// The table of touches: newest first, the running one on top. A row that is chosen can be assigned, left out or kept. Of
// thousands of rows only those in sight are in the document.

import { $, aligned, arrange, make, put } from "./dom.js";
import {
  clock,
  inUnit,
  modulusOf,
  places,
  plusMinus,
  scatterWords,
  settings,
  shoreA,
  signed,
} from "./formatting.js";
import { running } from "./reading.js";

const AFTER_S = 2; // a mark up to this long after a touch is in its row
const SPARE = 1000; // px above and below what is in sight
const STEPS = {
  ArrowDown: 1,
  ArrowUp: -1,
  PageDown: 10,
  PageUp: -10,
  Home: -Infinity,
  End: Infinity,
};

export class Table {
  live = make("tr", { className: "live", hidden: true });

  // send(message): undefined, if nothing can be changed; choose(number of a touch)
  constructor(known, send, choose) {
    Object.assign(this, { known, send, choose });
    this.made = new Map(); // touch -> its row
    this.heights = new Map(); // touch -> height of its row, px
    this.rows = [];
    $("rows").addEventListener("click", (event) => this.click(event));
    $("rows").addEventListener("keydown", (event) => this.step(event));
    document.addEventListener("scroll", () => this.draw(), { capture: true, passive: true });
    $("rows")
      .closest(".scroll")
      .addEventListener("scrollend", () => this.align());
    addEventListener("resize", () => {
      this.heights.clear();
      this.draw();
    });
    addEventListener("beforeprint", () => this.draw(true));
  }

  update(type) {
    if (["touches", "events", "session", "hello", "chosen", "found"].includes(type)) this.show();
    if (type === "state") this.showRunning();
    if (type === "chosen") this.reveal();
  }

  show() {
    const { touches, found, hello, session } = this.known;
    if (this.of !== (found ?? touches)) {
      this.of = found ?? touches;
      this.rows = found ?? touches.rows.toReversed();
      this.widest = widest(touches.rows);
    }
    const named = session.specimens.length || touches.rows.some(({ specimen }) => specimen);
    const compared = touches.rows.some(({ deviation }) => Number.isFinite(deviation));
    $("touches").classList.toggle("unnamed", !named);
    $("touches").classList.toggle("single", !compared);
    $("touches").classList.toggle("uncalibrated", !hello.calibrated);
    this.draw();
    this.showTogether(touches.together);
    this.showRunning();
  }

  // Whether the touches agree, and their modulus if they do.
  showTogether(together) {
    const modulus = together?.modulus
      ? `; if all are on one object (95 % interval): ${inUnit(together.modulus.text)}`
      : "";
    put("together", together ? together.text + modulus : "");
    $("together").hidden = !together;
    $("together").dataset.agree = together?.agree === false ? "no" : "yes";
  }

  // Draws the rows in sight, the one that has the focus and the chosen one; a gap takes the place of the rows between them.
  draw(all = false, also = null) {
    const place = $("rows");
    const focused = numberOf(document.activeElement);
    const always = [focused, this.known.chosen, also];
    const { top, bottom } = this.sight();
    const usual = this.usualHeight();
    const rows = [];
    const shown = [this.live];
    let y = this.live.offsetHeight;
    let gap = 0;
    for (const [at, one] of this.rows.entries()) {
      const high = this.heights.get(one.number) ?? usual;
      const near = y + high > top - SPARE && y < bottom + SPARE;
      y += high;
      if (!all && !near && !always.includes(one.number)) {
        gap += high;
        continue;
      }
      if (gap) shown.push(gapRow(gap));
      gap = 0;
      const row = this.same(one, one.number === this.known.chosen);
      row.ariaRowIndex = at + 2;
      rows.push(row);
      shown.push(row);
    }
    if (gap) shown.push(gapRow(gap));
    if (!rows.length) shown.push(emptyRow(this.known.found));
    place.closest("table").ariaRowCount = this.rows.length + 1;
    this.made = new Map(rows.map((row) => [row.dataset.touch, row]));
    arrange(place, shown);
    for (const row of rows) this.heights.set(Number(row.dataset.touch), row.offsetHeight);
    if (focused && numberOf(document.activeElement) !== focused) this.focus(focused, true);
    this.coverHalfRow();
  }

  // What is in sight, px below the first row.
  sight() {
    const { top: first } = $("rows").getBoundingClientRect();
    const box = $("rows").closest(".scroll").getBoundingClientRect();
    return {
      top: Math.max(box.top, 0) - first,
      bottom: Math.min(box.bottom, innerHeight) - first,
    };
  }

  usualHeight() {
    if (!this.heights.size) return 24;
    const sum = [...this.heights.values()].reduce((all, px) => all + px);
    return sum / this.heights.size;
  }

  // A row that the lower edge would cut is covered: the table shows whole rows.
  coverHalfRow() {
    const scroll = $("rows").closest(".scroll");
    const edge = scroll.getBoundingClientRect().top + scroll.clientTop + scroll.clientHeight;
    let cut = 0;
    for (const row of this.made.values()) {
      const { top, bottom } = row.getBoundingClientRect();
      if (top < edge && bottom > edge + 1) cut = edge - top;
    }
    if (cut > scroll.clientHeight / 2) cut = 0; // a row as high as the table
    scroll.style.setProperty("--cut", `${cut}px`);
  }

  focus(number, preventScroll = false) {
    this.made.get(String(number))?.querySelector("button").focus({ preventScroll });
  }

  // The chosen row comes into sight where the table scrolls by itself.
  reveal() {
    const { scrollHeight, clientHeight } = $("rows").closest(".scroll");
    if (scrollHeight <= clientHeight) return;
    this.made.get(String(this.known.chosen))?.scrollIntoView({ block: "nearest" });
    this.align();
  }

  // At rest no row is cut by the upper edge: the table scrolls on to the next row.
  align() {
    const scroll = $("rows").closest(".scroll");
    const head = $("touches").querySelector("thead").getBoundingClientRect();
    const edge = Math.max(head.bottom, scroll.getBoundingClientRect().top);
    const rest = scroll.scrollHeight - scroll.clientHeight - scroll.scrollTop;
    for (const row of this.made.values()) {
      const { top, bottom } = row.getBoundingClientRect();
      if (top < edge - 1 && bottom > edge + 1 && bottom - edge <= rest) {
        scroll.scrollBy(0, bottom - edge);
        break;
      }
    }
    this.coverHalfRow();
  }

  // By a key from row to row.
  step(event) {
    const from = this.rows.findIndex((one) => one.number === numberOf(event.target));
    const by = STEPS[event.key];
    if (!by || from < 0 || event.target.closest("select")) return;
    event.preventDefault();
    const to = this.rows[Math.max(0, Math.min(this.rows.length - 1, from + by))];
    this.draw(false, to.number);
    this.focus(to.number);
  }

  // The row that is there, if it would be the same: of thousands of cells only the new ones are made.
  same(one, chosen) {
    const { session, touches } = this.known;
    const names = chosen && session.specimens.map(({ name }) => name);
    const best = one.number === touches.most_reliable;
    const remark = remarkOf(one, this.known);
    const of = JSON.stringify([one, settings, this.widest, remark, names, best]);
    const made = this.made.get(String(one.number));
    return made?.of === of ? made : Object.assign(this.row(one, chosen), { of });
  }

  row(one, chosen) {
    const { hello, touches } = this.known;
    const out = one.kept === false;
    const changes = chosen && this.send && (hello.kind !== "file" || hello.file.amendable);
    const specimen = changes ? this.picker(one) : (one.specimen ?? "");
    const buttons = changes ? [this.keeper(one, out)] : [];
    const row = this.cells(one, specimen, remarkOf(one, this.known), buttons);
    row.dataset.touch = one.number;
    row.classList.toggle("out", out);
    row.classList.toggle("chosen", chosen);
    row.classList.toggle("best", one.number === touches.most_reliable);
    return row;
  }

  // The button that leaves a touch out, or takes it back.
  keeper({ number }, out) {
    const onclick = () => this.send({ do: out ? "keep" : "discard", touch: number });
    return make("button", { type: "button", textContent: out ? "Keep" : "Leave out", onclick });
  }

  cells(one, specimen, remark, more = []) {
    const { interval, shore } = modulusOf(one.modulus);
    const [text, sure] = plusMinus(one.ratio, one.uncertainty);
    const ariaLabel = `Touch ${one.number}: show it`;
    const nth = make("button", { type: "button", className: "plain", textContent: one.number });
    nth.ariaLabel = ariaLabel;
    const { hello, found } = this.known;
    const begin = found ? clock(one.start_s - (hello.origin_s ?? 0)) : "";
    const [mean, last] = this.meanCells(one);
    const optional = (textContent) => make("span", { className: "opt", textContent });
    const beside = shore ? [optional(` · ${shore}`)] : [];
    const title = scatterWords(one.uncertainty_from);
    const words = [...more];
    if (remark) {
      words.push(make("div", { className: "remark", textContent: remark, title: remark }));
    }
    const ratio = [aligned(text, this.widest.ratio), optional(` ${sure}`)];
    return make(
      "tr",
      {},
      make("td", {}, nth),
      make("td", { className: "begin", textContent: begin }),
      make("td", { className: "name" }, specimen),
      make("td", { className: "num", title }, ...ratio),
      make("td", {}, mean),
      make("td", { className: "num" }, last, ...beside),
      make("td", { className: "opt", textContent: interval.replace(/ [kM]Pa$/, "") }),
      make("td", { className: "name" }, ...words),
    );
  }

  // The distance from the mean of the specimen, and the modulus.
  meanCells({ deviation, modulus }) {
    const away = Number.isFinite(deviation) ? signed(100 * deviation, 1) : "–";
    return [aligned(away, 1), aligned(modulusOf(modulus).value, this.widest.modulus)];
  }

  showRunning() {
    const { state, touches, session, hello } = this.known;
    const on = running(state) && state.now?.tone !== "fault" && !this.known.offline;
    this.live.hidden = !on;
    if (!on) return;
    const share = state.now?.share;
    const seconds = share && hello.seconds ? `, ${(share * hello.seconds).toFixed(1)} s` : "";
    const mean = session.specimens.find(({ name }) => name === state.on)?.mean;
    const number = (touches.rows.at(-1)?.number ?? 0) + 1;
    const one = { ...state, number, deviation: mean ? state.ratio / mean - 1 : null };
    this.live.replaceChildren(...this.cells(one, state.on ?? "", `measuring${seconds}`).cells);
    this.live.cells[0].textContent = number;
  }

  picker({ number, specimen }) {
    const names = ["", ...this.known.session.specimens.map(({ name }) => name)];
    const options = names.map((name) => {
      return new Option(name || "none", name, false, name === (specimen ?? ""));
    });
    const onchange = ({ target }) => {
      this.send({ do: "assign", touch: number, name: target.value });
    };
    return make("select", { onchange, ariaLabel: `Specimen of touch ${number}` }, ...options);
  }

  click(event) {
    const row = event.target.closest("tr");
    const touch = Number(row?.dataset.touch);
    if (!touch || event.target.closest("select, option, td:last-child button")) return;
    this.choose(touch === this.known.chosen ? null : touch);
  }
}

function gapRow(px) {
  const style = `height: ${px}px`;
  return make("tr", { className: "gap", ariaHidden: "true", style }, make("td"));
}

function emptyRow(found) {
  const textContent = found ? "No touch is found." : "No touch yet.";
  return make("tr", {}, make("td", { colSpan: 8, className: "empty", textContent }));
}

export function remarkOf(one, { events, touches, found }) {
  if (one.kept === false) return `▲ left out. ${one.why || one.advice.join(". ")}`;
  const parts = [];
  if (one.number === touches.most_reliable) parts.push("use this one if you need a single touch");
  parts.push(...one.advice);
  if (one.modulus?.extrapolated) parts.push("beyond the calibration");
  if (one.revised && !found) parts.push("corrected by the baseline after the release");
  for (const { t_s: t, text } of events.marks) {
    if (text && t > one.start_s && t < one.end_s + AFTER_S) parts.push(text);
  }
  return parts.join(". ");
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
    if (!scatter) continue;
    const { own_error: error, ratio } = one;
    one.uncertainty = error === null ? null : Math.hypot(error, scatter.share * ratio);
    one.uncertainty_from = scatter.source;
  }
  return { rows: all, ...more };
}

function widest(rows) {
  const most = (text) => Math.max(0, ...rows.map((one) => places(text(one))));
  return {
    ratio: most((one) => plusMinus(one.ratio, one.uncertainty)[0]),
    modulus: most((one) => modulusOf(one.modulus).value),
  };
}

// The table of touches as text: with all digits, for a spreadsheet; moduli in the unit that is set.
const NUMBERS = [
  "specimen",
  "start_s",
  "end_s",
  "samples",
  "ratio",
  "standard_error",
  "uncertainty",
  "uncertainty_from",
  "covariance",
  "alarm_share",
];
function columnsNow() {
  const moduli = ["value", "low", "high"].map((name) => {
    const head = `${name === "value" ? "modulus" : name}_${settings.unit}`;
    return [head, ({ modulus }) => inUnit(modulus?.[`${name}_MPa`] ?? "")];
  });
  const shore = ["shore_A", ({ modulus }) => shoreA(modulus?.value_MPa ?? null)];
  return [
    ["touch", (one) => one.number],
    ...NUMBERS.map((name) => [name, (one) => one[name]]),
    ...moduli,
    ...(settings.shore === "on" ? [shore] : []),
    ["deviation", (one) => one.deviation],
    ["kept", (one) => (one.kept === false ? "no" : "yes")],
    ["flags", (one) => one.flags.join(" ")],
    ["remark", (one) => one.why || one.advice.join(". ")],
  ];
}

export function asText(rows, separator) {
  const cell = (value) => quoted(String(value ?? ""), separator);
  const columns = columnsNow();
  const heads = columns.map(([name]) => name);
  const lines = rows.map((one) => columns.map(([, of]) => of(one)));
  const texts = [heads, ...lines].map((line) => line.map(cell).join(separator));
  return texts.map((text) => `${text}\r\n`).join("");
}

export function save(rows, name) {
  const address = URL.createObjectURL(new Blob([asText(rows, ",")], { type: "text/csv" }));
  make("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 1000);
}

// A spreadsheet would run a text that begins so as a formula.
function quoted(text, separator) {
  const safe = /^[=+\-@\t\r]/.test(text) && Number.isNaN(Number(text)) ? `'${text}` : text;
  return safe.includes(separator) || /["\r\n]/.test(safe)
    ? `"${safe.replaceAll('"', '""')}"`
    : safe;
}
