// What is read from the charts: the values beside the pointer, and at two cursors.

import { fill, make } from "../dom.js";
import { clock, number, signed } from "../formatting.js";

export class Hover {
  constructor(place) {
    this.place = place;
    place.classList.add("plot");
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

const CUT_MS = 300; // a cursor that is dragged asks when it rests

// Cursors A and B, the table of their values and differences, and the result of the part between them.
export class Cursors {
  // place: element of the table; rows: Rows; tale: Tale; changed(): draw anew; cut(from, to): the part between the cursors is another one
  constructor(place, { rows, tale, changed, cut }) {
    Object.assign(this, { place, rows, tale, changed, cut });
    this.clear();
  }

  put(which, time) {
    const { begin, end } = this.rows.extent;
    this.times[which] = Math.max(begin, Math.min(end, time));
    this.rows.exactly(this.times[which]);
    this.tell("");
    const [from, to] = this.times.toSorted((a, b) => a - b);
    if (!this.times.includes(null) && from < to) this.asking = setTimeout(() => this.cut(from, to), CUT_MS);
  }

  tell(text) {
    clearTimeout(this.asking);
    this.told = text;
    this.changed();
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
    const [a, b] = this.values;
    this.place.hidden = !a && !b;
    if (this.place.hidden) return;
    const { begin } = this.rows.extent, pF = (one) => (Number.isFinite(one) ? one.toFixed(4).replace(/^-(?=[0.]*$)/, "").replace("-", "−") : "–");
    const line = (name, text, difference) => [name, a ? text(a) : "", b ? text(b) : "", a && b ? difference : ""];
    const less = (name) => (a && b && Number.isFinite(b[name] - a[name]) ? signed(b[name] - a[name], 4) : "–");
    const share = a && b && Number.isFinite(b.ratio / a.ratio) ? `${signed(100 * (b.ratio / a.ratio - 1), 2)} %` : "–";
    const lines = [
      ["", "A", "B", "B − A"],
      line("time", ({ t }) => clock(t - begin, 2), `${signed((b?.t ?? 0) - (a?.t ?? 0), 2)} s`),
      line("hard, pF", ({ hard }) => pF(hard), less("hard")),
      line("soft, pF", ({ soft }) => pF(soft), less("soft")),
      line("ratio", ({ ratio, error }) => (Number.isFinite(ratio) ? number(ratio, error) : "–"), share),
      line("touch", ({ touch }) => (touch ? [touch.number, touch.specimen].filter((part) => part !== null && part !== undefined).join(", ") : "–"), ""),
    ];
    const cell = (textContent, i, k) => (i && k ? make("td", { textContent }) : make("th", { textContent, scope: !textContent ? "" : i ? "row" : "col" }));
    const table = () => make("table", {}, ...lines.map((texts, i) => make("tr", {}, ...texts.map((text, k) => cell(text, i, k)))));
    fill(this.place, [...lines, this.told], () => [table(), make("p", { textContent: this.told })]);
  }
}
