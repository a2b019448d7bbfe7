// Values that are read from the charts: at the pointer, and at two cursors.

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
    const most = this.place.clientWidth;
    const width = this.tip.offsetWidth;
    this.hair.style.left = `${x}px`;
    this.tip.style.left = `${Math.max(0, x + 10 + width <= most ? x + 10 : x - 10 - width)}px`;
  }

  hide() {
    this.hair.hidden = this.tip.hidden = true;
  }
}

const AROUND_S = 0.1;
const CUT_MS = 300; // a cursor that is dragged asks when it rests

// Cursors A and B, the table of their values and differences, and the result of the part between them.
export class Cursors {
  // place: element of the table; charts: Charts; cut(from, to): the part between the cursors is another one
  constructor(place, charts, cut) {
    Object.assign(this, { place, charts, cut, rows: charts.rows, annotations: charts.annotations });
    this.clear();
  }

  put(which, time) {
    const { begin, end } = this.rows.extent;
    const at = Math.max(begin, Math.min(end, time));
    this.times[which] = at;
    this.rows.once(`at ${at}`, at - AROUND_S, at + AROUND_S); // so that its values are those of a row
    this.showAnswer("");
    const [from, to] = this.times.toSorted((a, b) => a - b);
    if (this.times.includes(null) || from >= to) return;
    this.waiting = setTimeout(() => this.cut(from, to), CUT_MS);
  }

  // The result of the part between the cursors.
  showAnswer(text) {
    clearTimeout(this.waiting);
    this.answer = text;
    this.charts.redraw("time");
  }

  clear() {
    this.times = [null, null];
    this.showAnswer("");
  }

  // Values at both cursors; a cursor that is not set has none.
  get values() {
    return this.times.map((t) =>
      t === null ? null : { ...this.rows.at(t), t, touch: this.annotations.touchAt(t) },
    );
  }

  draw() {
    const [a, b] = this.values;
    this.place.hidden = !a && !b;
    const lines = this.lines(a, b);
    fill(this.place, [...lines, this.answer], () => {
      const rows = lines.map((texts, i) =>
        make("tr", {}, ...texts.map((text, k) => cellOf(text, i, k))),
      );
      return [make("table", {}, ...rows), make("p", { textContent: this.answer })];
    });
  }

  lines(a, b) {
    const { begin } = this.rows.extent;
    const known = (value, text) => (Number.isFinite(value) ? text : "–");
    const value = (name, one) => known(one[name], signed(one[name], 4).replace("+", ""));
    const line = (name, text, difference) => {
      return [name, a ? text(a) : "", b ? text(b) : "", a && b ? difference() : ""];
    };
    const channel = (name) => {
      const change = () => known(b[name] - a[name], signed(b[name] - a[name], 4));
      return line(`${name}, pF`, (one) => value(name, one), change);
    };
    const percent = () => known(b.ratio / a.ratio, `${signed(100 * (b.ratio / a.ratio - 1), 2)} %`);
    const seconds = () => `${signed(b.t - a.t, 2)} s`;
    const touchOf = ({ touch }) =>
      [touch?.number ?? "–", touch?.specimen].filter(Boolean).join(", ");
    return [
      ["", "A", "B", "B − A"],
      line("time", ({ t }) => clock(t - begin, 2), seconds),
      channel("hard"),
      channel("soft"),
      line("ratio", ({ ratio, error }) => known(ratio, number(ratio, error)), percent),
      line("touch", touchOf, () => ""),
    ];
  }
}

// A cell of the table: the first row and the first column are heads.
function cellOf(textContent, row, column) {
  if (row && column) return make("td", { textContent });
  const scope = row ? "row" : "col";
  return make("th", { textContent, scope: textContent ? scope : "" });
}
