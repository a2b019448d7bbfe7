// All rows of the measurement, as far as they are known: views of its earlier parts, and the newest rows.

import { indexOf } from "../store.js";
import { nearest, span } from "./plot.js";
import { Views } from "./views.js";

const AROUND_S = 0.1, EXACT_ROWS = 512; // for a cursor: every row up to 2,500 pairs per second

export class Rows {
  constructor(store, say, changed) {
    this.store = store;
    this.views = new Views(say, changed);
    store.view = (id, block) => this.views.take(id, block, this.extent.end);
    store.again = () => this.views.clear();
    this.clear();
  }

  clear() {
    this.views.clear();
    this.told = { begin: null, end: null }; // by the server's messages
  }

  // begin, end: of the measurement, in the source's seconds; held: from here on all rows are here.
  get extent() {
    const { block, now, used } = this.store, first = used ? block.t[block.first] : Infinity;
    const begin = Math.min(this.told.begin ?? first, first), end = Math.max(this.told.end ?? 0, used ? now : 0);
    return Number.isFinite(begin) ? { begin, end: Math.max(begin, end), held: Math.min(first, Math.max(begin, end)) } : { begin: 0, end: 0, held: 0 };
  }

  // Blocks that together show [from, to], each with the rows of it that do.
  pieces(from, to) {
    const { block } = this.store, { held } = this.extent, parts = [];
    if (from < held) {
      const view = this.views.best(from, Math.min(to, held));
      if (view) parts.push({ block: view.block, rows: span(view.block, from, Math.min(to, held)) });
    }
    if (to >= held) parts.push({ block, rows: span(block, Math.max(from, held), to) });
    return parts.filter(({ rows: [first, end] }) => end > first);
  }

  // The row nearest to a moment, with its values; from the finest rows that are known.
  at(time) {
    const { held } = this.extent, view = time < held ? this.views.best(time, time) : null;
    const block = view ? view.block : this.store.block, k = nearest(block, time);
    return k < 0 ? null : { t: block.t[k], hard: block.hard[k], soft: block.soft[k], ratio: block.ratio[k], error: block.error[k], statistic: block.statistic[k] };
  }

  // Lowest and highest values of [from, to]: one pixel's.
  within(name, from, to) {
    const range = [Infinity, -Infinity];
    for (const { block } of this.pieces(from, to)) {
      const end = indexOf(block, to);
      for (let k = indexOf(block, from); k < end; k++) {
        range[0] = Math.min(range[0], Number.isNaN(block[name][k]) ? Infinity : block[name][k]);
        range[1] = Math.max(range[1], Number.isNaN(block[name][k]) ? -Infinity : block[name][k]);
      }
    }
    return range;
  }

  // Asks for every row around a moment, so that its values are those of a row.
  exactly(time) {
    if (time < this.extent.held) this.views.ask(`at ${time}`, time - AROUND_S, time + AROUND_S, EXACT_ROWS);
  }
}
