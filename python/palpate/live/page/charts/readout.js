// What is read from the charts: the values beside the pointer, and at two cursors.

import { fill, make } from "../dom.js";
import { clock, number, signed } from "../formatting.js";

export class Hover {
  constructor(place) {
    this.place = place;
    const ariaHidden = "true"; // the numbers are in the table, and in the cursors' read-out
    this.hair = place.appendChild(make("i", { className: "hair", ariaHidden }));
    this.tip = place.appendChild(make("p", { className: "tip", ariaHidden }));
    this.hide();
  }

  // lines: texts, the first is what they belong to.
  show(x, lines) {
    this.tip.replaceChildren(...lines.map((text) => make("span", { textContent: text })));
    this.hair.hidden = this.tip.hidden = false;
    const most = this.place.clientWidth, width = this.tip.offsetWidth;
    this.hair.style.left = `${x}px`;
    this.tip.style.left = `${Math.max(0, x + 10 + width <= most ? x + 10 : x - 10 - width)}px`;
  }

  hide() {
    this.hair.hidden = this.tip.hidden = true;
  }
}

const AROUND_S = 0.1, CUT_MS = 300; // a cursor that is dragged asks when it rests

// Cursors A and B, the table of their values and differences, and the result of the part between them.
export class Cursors {
  // place: element of the table; charts: Charts; cut(from, to): the part between the cursors is another one
  constructor(place, charts, cut) {
    Object.assign(this, { place, charts, cut, rows: charts.rows, tale: charts.tale });
    this.clear();
  }

  put(which, time) {
    const { begin, end } = this.rows.extent;
    this.times[which] = Math.max(begin, Math.min(end, time));
    this.rows.once(`at ${this.times[which]}`, this.times[which] - AROUND_S, this.times[which] + AROUND_S); // so that its values are those of a row
    this.tell("");
    const [from, to] = this.times.toSorted((a, b) => a - b);
    if (!this.times.includes(null) && from < to) this.asking = setTimeout(() => this.cut(from, to), CUT_MS);
  }

  tell(text) {
    clearTimeout(this.asking);
    this.told = text;
    this.charts.redraw("time");
  }

  clear() {
    this.times = [null, null];
    this.tell("");
  }

  // Values at both cursors; a cursor that is not set has none.
  get values() {
    return this.times.map((t) => (t === null ? null : { ...this.rows.at(t), t, touch: this.tale.touchAt(t) }));
  }

  draw() {
    const [a, b] = this.values, { begin } = this.rows.extent;
    this.place.hidden = !a && !b;
    const line = (name, text, difference) => [name, a ? text(a) : "", b ? text(b) : "", a && b ? difference() : ""];
    const known = (value, text) => (Number.isFinite(value) ? text : "–");
    const pF = (name) => line(`${name}, pF`, (one) => known(one[name], signed(one[name], 4).replace("+", "")), () => known(b[name] - a[name], signed(b[name] - a[name], 4)));
    const lines = [
      ["", "A", "B", "B − A"],
      line("time", ({ t }) => clock(t - begin, 2), () => `${signed(b.t - a.t, 2)} s`),
      pF("hard"),
      pF("soft"),
      line("ratio", ({ ratio, error }) => known(ratio, number(ratio, error)), () => known(b.ratio / a.ratio, `${signed(100 * (b.ratio / a.ratio - 1), 2)} %`)),
      line("touch", ({ touch }) => (touch ? [touch.number, touch.specimen ?? []].flat().join(", ") : "–"), () => ""),
    ];
    const cell = (textContent, i, k) => (i && k ? make("td", { textContent }) : make("th", { textContent, scope: !textContent ? "" : i ? "row" : "col" }));
    const table = () => make("table", {}, ...lines.map((texts, i) => make("tr", {}, ...texts.map((text, k) => cell(text, i, k)))));
    fill(this.place, [...lines, this.told], () => [table(), make("p", { textContent: this.told })]);
  }
}
