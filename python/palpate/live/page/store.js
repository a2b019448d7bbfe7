// The newest rows of the measurement, or all of them: one typed array for each column, the newest row last.

const FIELDS = ["t", "hard", "soft", "ratio", "error", "statistic"];
export const MEASURED = 2; // of the flags of a row
const KEPT = 16384; // 160 s at 100 pairs per second, 16 s at 1,000
const HEADER = 16, VERSION = 3, AGAIN = 1, VIEW = 2;

export class Store {
  // kept: how many of the newest rows; Infinity: all, then the columns grow.
  constructor(kept = KEPT) {
    this.kept = kept;
    this.columns = Object.fromEntries(FIELDS.map((name) => [name, new Float64Array(2 * KEPT)]));
    this.columns.flags = new Uint8Array(2 * KEPT);
    this.used = 0;
  }

  // Takes a frame from live/feed.py. Rows has set view(id, block), for a view that comes, and again(): all rows before are no longer valid.
  take(buffer) {
    const [version, number, size, kind] = new Uint32Array(buffer, 0, 4);
    if (version !== VERSION) throw new Error(`frame: got version ${version}, allowed: ${VERSION}; reload the page`);
    const block = blockOf(buffer, size);
    if (kind === VIEW) return this.view(number, block);
    if (kind === AGAIN) {
      this.used = 0;
      this.again();
    }
    this.add(block);
  }

  add(block) {
    this.makeRoom(block.end);
    for (const [name, column] of Object.entries(this.columns)) column.set(block[name], this.used);
    this.used += block.end;
  }

  makeRoom(size) {
    const { length } = this.columns.t, first = Math.max(this.used - this.kept, 0);
    if (this.used + size <= length) return;
    for (const [name, column] of Object.entries(this.columns)) {
      this.columns[name] = new column.constructor(this.kept === Infinity ? 2 * (this.used + size) : length);
      this.columns[name].set(column.subarray(first, this.used));
    }
    this.used -= first;
  }

  // The kept rows as a block: columns, flags, and the rows [first, end) of them that are valid; bin: 0, all rows are there.
  get block() {
    return { ...this.columns, first: Math.max(this.used - this.kept, 0), end: this.used, bin: 0 };
  }
}

function blockOf(buffer, size) {
  const block = { first: 0, end: size, flags: new Uint8Array(buffer, HEADER + 8 * FIELDS.length * size, size) };
  FIELDS.forEach((name, i) => (block[name] = new Float64Array(buffer, HEADER + 8 * i * size, size)));
  return block;
}

// Index of the first row of a block that is not before a time.
export function indexOf(block, time) {
  let low = block.first, high = block.end;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (block.t[middle] < time) low = middle + 1;
    else high = middle;
  }
  return low;
}
