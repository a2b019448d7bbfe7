// All rows of the measurement, as far as they are known: the newest rows, and views of its earlier parts at the resolution of the
// screen: asked from the server, kept, and chosen from.

import { indexOf } from "../store.js";
import { extremes, nearest, span } from "./plot.js";

const EXACT_ROWS = 512; // in 0.2 s around a cursor every row up to 2,500 pairs per second
const EVERY_MS = 70; // what is wanted is asked for together, fewer than 15 times a second
const PATIENCE_MS = 3000; // then a request may have been lost with its connection
const KEPT = 24;
const ROWS = 8192;
const WIDER = 3; // windows in one view: a pan is drawn from it
const NEAR = 0.4; // windows before the edge of a view the next one is asked for
const COARSE = 1.5; // a view is fine enough if its bins are at most this many times as long as the wanted ones

export class Rows {
  id = 0;
  sentAt = -EVERY_MS;

  // send(message): to the server; changed(): a view has come.
  constructor(store, known, send, changed) {
    Object.assign(this, { store, known, send, changed });
    store.view = (id, block) => this.take(id, block);
    store.again = () => this.clear();
    this.clear();
  }

  clear() {
    this.kept = []; // the newest used last
    this.wanted = new Map(); // purpose -> request
    this.requested = new Map(); // id -> request; answers of an earlier measurement are not taken
    this.id += 1000;
  }

  // begin, end: of the measurement, in the source's seconds; held: from here on all rows are here.
  get extent() {
    const { block, used } = this.store;
    const first = used ? block.t[block.first] : Infinity;
    const begin = Math.min(this.known.hello.origin_s ?? first, first);
    const end = Math.max(this.known.state.end_s ?? 0, used ? block.t[used - 1] : 0);
    return Number.isFinite(begin)
      ? { begin, end: Math.max(begin, end), held: Math.min(first, Math.max(begin, end)) }
      : { begin: 0, end: 0, held: 0 };
  }

  // Blocks that together show [from, to], each with the rows of it that do.
  pieces(from, to) {
    const { block } = this.store;
    const { held } = this.extent;
    const parts = [];
    if (from < held) {
      const view = this.best(from, Math.min(to, held));
      if (view) parts.push({ block: view.block, rows: span(view.block, from, Math.min(to, held)) });
    }
    if (to >= held) parts.push({ block, rows: span(block, Math.max(from, held), to) });
    return parts.filter(({ rows: [first, end] }) => end > first);
  }

  // The row nearest to a moment, with its values; from the finest rows that are known.
  at(time) {
    const { held } = this.extent;
    const view = time < held ? this.best(time, time) : null;
    const block = view ? view.block : this.store.block;
    const k = nearest(block, time);
    return k < 0
      ? null
      : {
          t: block.t[k],
          hard: block.hard[k],
          soft: block.soft[k],
          ratio: block.ratio[k],
          error: block.error[k],
          statistic: block.statistic[k],
        };
  }

  // Lowest and highest values of [from, to]: one pixel's.
  within(name, from, to) {
    const range = [Infinity, -Infinity];
    for (const { block } of this.pieces(from, to))
      extremes(block, [name], [indexOf(block, from), indexOf(block, to)], range);
    return range;
  }

  // Asks for the rows of [from, to], which `take` gets if it is given, unless they are here or under way.
  once(purpose, from, to, take) {
    if (from >= this.extent.held || this.expects(purpose)) return;
    this.request(purpose, from, to, EXACT_ROWS, take);
  }

  // Asks for rows of [from, to]. Of each purpose only the newest request counts. take(block): gets them, in place of the view.
  request(purpose, from, to, rows, take) {
    rows = Math.min(Math.max(Math.round(rows), 2), ROWS);
    this.wanted.set(purpose, { purpose, from, to, rows, take, bin: (2 * (to - from)) / rows });
    const wait = Math.max(0, this.sentAt + EVERY_MS - performance.now());
    this.timer ??= setTimeout(() => this.sendWanted(), wait);
  }

  sendWanted() {
    this.timer = null;
    this.sentAt = performance.now();
    for (const request of this.wanted.values()) {
      const { from, to, rows } = request;
      if (!this.send({ do: "view", id: ++this.id, from_s: from, to_s: to, rows })) continue;
      this.requested.set(this.id, { ...request, at: this.sentAt });
    }
    this.wanted.clear();
  }

  // Takes an answer; rows that are newer than the measurement now are not in the view.
  take(id, block) {
    const request = this.requested.get(id);
    if (!request) return;
    this.requested.delete(id);
    block.bin = request.bin;
    if (request.take) {
      request.take(block);
      return;
    }
    this.kept = this.kept.filter((one) => one.purpose !== "all" || request.purpose !== "all");
    this.kept.push({ ...request, to: Math.min(request.to, this.extent.end), block });
    if (this.kept.length > KEPT) {
      const oldest = this.kept.findIndex((one) => one.purpose !== "all");
      this.kept.splice(oldest, 1);
    }
    this.changed();
  }

  // The view of everything, if it is there.
  get all() {
    return this.kept.find((one) => one.purpose === "all") ?? null;
  }

  // The finest view that has all of [from, to]; else the view of everything.
  best(from, to) {
    const whole = this.kept.filter((one) => one.from <= from && one.to >= to);
    const found = whole.reduce((best, one) => (best && best.bin <= one.bin ? best : one), null);
    if (found) this.kept.push(this.kept.splice(this.kept.indexOf(found), 1)[0]);
    return found ?? this.all;
  }

  // Asks for what a window still needs: three times as wide, so that it can be moved.
  need(from, to) {
    const { begin, held, end } = this.extent;
    if (from >= held) return;
    const span = to - from;
    const near = NEAR * span;
    const margin = ((WIDER - 1) / 2) * span;
    const bin = (2 * WIDER * span) / ROWS;
    const has = (one) =>
      one.bin <= COARSE * bin &&
      one.from <= Math.max(from - near, begin) &&
      one.to >= Math.min(to + near, held) - 1e-9;
    if (![...this.kept, ...this.underWay()].some(has))
      this.request("window", Math.max(from - margin, begin), Math.min(to + margin, end), ROWS);
  }

  expects(purpose) {
    return this.underWay().some((one) => one.purpose === purpose);
  }

  underWay() {
    const now = performance.now();
    return [...this.requested.values(), ...this.wanted.values()].filter(
      ({ at = now }) => now - at < PATIENCE_MS,
    );
  }
}
