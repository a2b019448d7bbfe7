// The rows of the page: one typed array of fixed size for each column, the newest row last.

export const FIELDS = ["t", "hard", "soft", "ratio", "error", "statistic"];
export const MEASURED = 2, ALARM = 4;
const KEPT = 16384; // 160 s at 100 pairs per second, 16 s at 1,000
const HEADER = 16, VERSION = 3;

export class Store {
  constructor() {
    this.columns = columnsOf(2 * KEPT);
    this.flags = new Uint8Array(2 * KEPT);
    this.thin = { size: 0, columns: columnsOf(KEPT), flags: new Uint8Array(KEPT) };
    this.clear();
  }

  clear() {
    this.used = 0;
    this.origin = null; // time of the first sample, s
  }

  // Adds a frame from live/feed.py. Returns its number.
  take(buffer) {
    const [version, number, size, past] = new Uint32Array(buffer, 0, 4);
    if (version !== VERSION) throw new Error(`frame: got version ${version}, allowed: ${VERSION}; reload the page`);
    if (past) this.clear();
    const kept = Math.min(size, KEPT), from = size - kept;
    this.makeRoom(kept);
    FIELDS.forEach((name, i) => {
      this.columns[name].set(new Float64Array(buffer, HEADER + 8 * (i * size + from), kept), this.used);
    });
    this.flags.set(new Uint8Array(buffer, HEADER + 8 * FIELDS.length * size + from, kept), this.used);
    if (this.origin === null && size) this.origin = this.columns.t[this.used];
    this.used += kept;
    return number;
  }

  makeRoom(size) {
    if (this.used + size <= 2 * KEPT) return;
    const first = Math.max(this.used - KEPT, 0);
    for (const column of [...Object.values(this.columns), this.flags]) column.copyWithin(0, first, this.used);
    this.used -= first;
  }

  get now() {
    return this.used ? this.columns.t[this.used - 1] : 0;
  }

  // The rows of the last `seconds`; where more than two are within `bin` seconds, their lowest and highest values, as
  // live/feed.py does. The result is valid until the next call.
  thinned(seconds, bin) {
    const [first, end] = this.last(seconds), { t } = this.columns;
    this.thin.size = 0;
    for (let from = first, to; from < end; from = to) {
      const number = Math.floor(t[from] / bin);
      for (to = from + 1; to < end && Math.floor(t[to] / bin) === number; to++);
      if (to - from > 2) this.addExtremes(from, to);
      else for (let k = from; k < to; k++) this.add(k);
    }
    return this.thin;
  }

  add(k) {
    const { columns, flags, size } = this.thin;
    for (const name of FIELDS) columns[name][size] = this.columns[name][k];
    flags[size] = this.flags[k];
    this.thin.size++;
  }

  addExtremes(from, to) {
    const { columns, flags, size } = this.thin;
    this.add(from);
    this.add(to - 1);
    for (const name of FIELDS.slice(1)) {
      const values = this.columns[name];
      let low = Infinity, high = -Infinity;
      for (let k = from; k < to; k++) {
        if (values[k] < low) low = values[k];
        if (values[k] > high) high = values[k];
      }
      if (high < low) low = high = NaN;
      const falls = values[to - 1] < values[from];
      columns[name][size] = falls || name === "error" ? high : low;
      columns[name][size + 1] = falls && name !== "error" ? low : high;
    }
    for (let k = from; k < to; k++) flags[size] |= this.flags[k];
    flags[size + 1] = flags[size];
  }

  // Indices [first, end) of the last `seconds`.
  last(seconds) {
    const t = this.columns.t, end = this.used, oldest = Math.max(end - KEPT, 0);
    let low = oldest, high = end;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (t[middle] < this.now - seconds) low = middle + 1;
      else high = middle;
    }
    return [low, end];
  }
}

function columnsOf(size) {
  return Object.fromEntries(FIELDS.map((name) => [name, new Float64Array(size)]));
}
