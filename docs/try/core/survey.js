// The rows of a recording on their way to the tracker: gaps and tares between them, and what there is to count.

const HOLE_S = 0.25; // a hole without a mark is shown from here on; all are counted
const WORDS = 7; // of eight bytes, in a sample

export class Survey {
  constructor(got, tares, largest) {
    Object.assign(this, { got, tares, largest, rows: 0, lost: 0, holes: 0, disordered: 0, backward: 0, miscoded: 0, pause: 0, before: 0n });
    this.seq = this.ns = this.first = null;
    this.shown = -Infinity;
  }

  // Gives the next rows of the module to the tracker, and puts what comes of them into `parts`.
  take(count, parts) {
    const { module } = this.got, { buffer } = module.wasm.memory;
    const words = new BigInt64Array(buffer, module.wasm.rows(), WORDS * count), halves = new Int32Array(buffer, module.wasm.rows(), 2 * WORDS * count);
    let begin = 0;
    for (let i = 0; i < count; i++) {
      this.follow(words[WORDS * i], words[WORDS * i + 1]);
      if (halves[2 * WORDS * i + 6] > this.largest || halves[2 * WORDS * i + 7] > this.largest) this.miscoded += 1;
      if (this.tares.size && this.tares.has(Number(this.seq))) {
        this.give(begin, i + 1, parts);
        this.tare();
        begin = i + 1;
      }
    }
    this.give(begin, count, parts);
    this.rows += count;
  }

  give(begin, end, parts) {
    this.got.module.take(begin, end, (block, touches) => parts.push(this.got.add(block, touches)));
  }

  // Measures the baseline again, as it was in the measurement.
  tare() {
    const { got } = this, { wasm } = got.module;
    if (this.tares.get(Number(this.seq)) === null) {
      wasm.tare(true);
      got.tares.push(Number(this.ns) * 1e-9);
    } else wasm.gap();
    got.note(got.module.touches());
  }

  follow(seq, ns) {
    const now = Number(ns) * 1e-9;
    this.first ??= ns;
    if (this.seq !== null) {
      const lost = seq > this.seq ? Number(seq - this.seq) - 1 : 0, marked = this.tares.size && this.tares.has(Number(this.seq));
      const text = marked ? this.tares.get(Number(this.seq)) : null, before = Number(this.ns) * 1e-9;
      if (lost) this.holes += 1;
      this.lost += lost;
      if (seq <= this.seq) this.disordered += 1;
      if (ns < this.ns) this.backward += 1;
      if (text !== null || (lost && now - before >= HOLE_S)) this.got.cut(text !== null ? this.shown : before, now, lost, text ?? `${lost} pairs are missing`);
      const step = Number(ns) / 1e9 - Number(this.ns) / 1e9;
      if (!marked && step > this.pause) [this.pause, this.before] = [step, this.seq];
    }
    [this.seq, this.ns] = [seq, ns];
    this.shown = Math.max(this.shown, now);
  }

  get seconds() {
    return this.first === null ? 0 : Number(this.ns - this.first) / 1e9;
  }

  // Why the file may differ from the measured samples.
  get faults() {
    return [
      [this.disordered, `${this.disordered} rows out of order: their seq does not rise`],
      [this.backward, `time goes back at ${this.backward} rows`],
      [this.miscoded, `${this.miscoded} rows have codes above ${this.largest}, the largest of the converter`],
    ].filter(([holds]) => holds).map(([, text]) => text);
  }

  notes(codes) {
    const { got, rows, lost, holes, pause, before } = this, period = this.seconds / (rows - 1 + lost);
    got.lost = lost;
    const paused = pause > Math.max(1, 20 * period);
    return [
      [codes === null, "the codes are not those of an AD7746, and no sidecar says their scale: left out"],
      [lost, `${lost} samples lost in ${holes === 1 ? "1 gap" : `${holes} gaps`}`],
      [got.useless, `${got.useless} rows without a usable value`],
      [got.limited, `${got.limited} rows are saturated`],
      [paused, `no sample for ${pause.toFixed(1)} s after sample ${before}, and no mark says why: if the board was opened again there, the baseline before does not hold, and the touches after it may be wrong`],
      [rows === 0, "no rows"],
    ].filter(([holds]) => holds).map(([, text]) => text);
  }
}
