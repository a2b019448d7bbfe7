// The newest rows of the measurement, or all of them: one typed array for each column, the newest row last.

const FIELDS = ["t", "hard", "soft", "ratio", "error", "statistic"];
export const MEASURED = 2; // of the flags of a row
const KEPT = 16384; // 160 s at 100 pairs per second, 16 s at 1,000
const HEADER = 16; // bytes
const VERSION = 3;
const ANEW = 1; // kinds of a frame
const VIEW = 2;

/**
 * @typedef {object} Block Rows [first, end) of columns; bin: s of one row, 0: each row is a sample.
 * @property {number} first
 * @property {number} end
 * @property {number} bin
 * @property {Float64Array} t
 * @property {Float64Array} hard
 * @property {Float64Array} soft
 * @property {Float64Array} ratio
 * @property {Float64Array} error
 * @property {Float64Array} statistic
 * @property {Uint8Array} flags
 */

export class Store {
  // kept: how many of the newest rows; Infinity: all, then the columns grow.
  constructor(kept = KEPT) {
    this.kept = kept;
    this.columns = { flags: new Uint8Array(2 * KEPT) };
    for (const name of FIELDS) {
      this.columns[name] = new Float64Array(2 * KEPT);
    }
    this.used = 0;
  }

  // Takes a frame of live/page_frames.py. Rows has set view(id, block), for a view that comes, and again(): all rows before are no longer valid.
  /** @param {ArrayBuffer} buffer */
  take(buffer) {
    const [version, number, size, kind] = new Uint32Array(buffer, 0, 4);
    if (version !== VERSION) {
      throw new Error(`frame: got version ${version}, allowed: ${VERSION}; reload the page`);
    }
    const block = blockOf(buffer, size);
    if (kind === VIEW) {
      this.view(number, block);
      return;
    }
    if (kind === ANEW) {
      this.used = 0;
      this.again();
    }
    this.add(block);
  }

  /** @param {Block} block */
  add(block) {
    this.makeRoom(block.end);
    for (const [name, column] of Object.entries(this.columns)) {
      column.set(block[name], this.used);
    }
    this.used += block.end;
  }

  makeRoom(size) {
    const { length } = this.columns.t;
    if (this.used + size <= length) return;
    const first = Math.max(this.used - this.kept, 0);
    const longer = this.kept === Infinity ? 2 * (this.used + size) : length;
    for (const [name, column] of Object.entries(this.columns)) {
      this.columns[name] = new column.constructor(longer);
      this.columns[name].set(column.subarray(first, this.used));
    }
    this.used -= first;
  }

  /** @returns {Block} The kept rows. */
  get block() {
    const first = Math.max(this.used - this.kept, 0);
    return { ...this.columns, first, end: this.used, bin: 0 };
  }
}

/** @returns {Block} */
function blockOf(buffer, size) {
  const block = { first: 0, end: size };
  let offset = HEADER;
  for (const name of FIELDS) {
    block[name] = new Float64Array(buffer, offset, size);
    offset += 8 * size;
  }
  block.flags = new Uint8Array(buffer, offset, size);
  return block;
}

// Index of the first row of a block that is not before a time.
export function indexOf(block, time) {
  let low = block.first;
  let high = block.end;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (block.t[middle] < time) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low;
}
