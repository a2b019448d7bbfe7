// Cursors A and B, and the table of their values and differences.

import { number } from "../formatting.js";
import { clock, signed } from "./ticks.js";

export class Cursors {
  // place: element of the table; rows: Rows; tale: Tale; changed(): a cursor has moved
  constructor(place, { rows, tale, changed }) {
    Object.assign(this, { place, rows, tale, changed });
    this.clear();
  }

  put(which, time) {
    const { begin, end } = this.rows.extent;
    this.times[which] = Math.max(begin, Math.min(end, time));
    this.rows.exactly(this.times[which]);
    this.changed();
  }

  clear() {
    this.times = [null, null];
    this.changed();
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
    this.table([
      ["", "A", "B", "B − A"],
      line("time", ({ t }) => clock(t - begin, 2), `${signed((b?.t ?? 0) - (a?.t ?? 0), 2)} s`),
      line("hard, pF", ({ hard }) => pF(hard), less("hard")),
      line("soft, pF", ({ soft }) => pF(soft), less("soft")),
      line("ratio", ({ ratio, error }) => (Number.isFinite(ratio) ? number(ratio, error) : "–"), share),
      line("touch", ({ touch }) => (touch ? [touch.number, touch.specimen].filter((part) => part !== null && part !== undefined).join(", ") : "–"), ""),
    ]);
  }

  table(lines) {
    const said = JSON.stringify(lines);
    if (this.said === said && this.place.firstChild) return;
    this.said = said;
    const table = document.createElement("table");
    for (const [i, texts] of lines.entries()) {
      const row = table.insertRow();
      texts.forEach((text, k) => {
        const head = !i || !k, cell = row.appendChild(document.createElement(head ? "th" : "td"));
        if (head && text) cell.scope = i ? "row" : "col";
        cell.textContent = text;
      });
    }
    this.place.replaceChildren(table);
  }
}
