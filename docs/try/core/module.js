// The module of the core: its memory as arrays, and its text. cpp/wasm/palpate.cpp says what its functions do.

export const FIELDS = ["t", "hard", "soft", "ratio", "error", "statistic"];
const ROW = 56; // bytes of a sample, cpp/rows/row.hpp
const NUMBERS = ["number", "start", "start_s", "end_s", "samples", "ratio", "covariance", "standard_error", "revised", "first_ratio", "first_standard_error",
  "offset_ratio", "offset_standard_error", "offset", "drift", "lag", "curve", "shift", "alarm_share", "saturated", "refused", "flags"];
const EFFECTS = ["offset", "drift", "lag", "curve", "shift"];

export class Module {
  static async of(compiled) {
    const self = new Module();
    const number = (at, size) => Number(self.ascii(at, size));
    self.wasm = (await WebAssembly.instantiate(compiled, { env: { number } })).exports;
    self.wasm._initialize();
    self.room = self.wasm.most();
    self.most = self.wasm.most_rows();
    self.names = self.word(self.wasm.flag_names()).split(",");
    return self;
  }

  begin({ seconds, samples, release, full_scale, host_stamps }) {
    this.wasm.begin(seconds ?? 0, samples ?? 0, release, full_scale, host_stamps);
  }

  ascii(at, size) {
    return String.fromCharCode(...new Uint8Array(this.wasm.memory.buffer, at, size));
  }

  // A text that ends with 0.
  word(at) {
    const bytes = new Uint8Array(this.wasm.memory.buffer, at);
    return this.ascii(at, bytes.indexOf(0));
  }

  // Reads whole lines: [rows that are plain, bytes of them].
  parse(bytes) {
    new Uint8Array(this.wasm.memory.buffer).set(bytes, this.wasm.text());
    return [this.wasm.parse(bytes.length), this.wasm.parsed()];
  }

  // The samples of the last text, or room for them.
  row(number) {
    const view = new DataView(this.wasm.memory.buffer, this.wasm.rows() + ROW * number, ROW);
    return {
      get seq() { return view.getBigInt64(0, true); },
      get t_hard_ns() { return view.getBigInt64(8, true); },
      get hard_raw() { return view.getInt32(24, true); },
      get soft_raw() { return view.getInt32(28, true); },
      get hard() { return view.getFloat64(32, true); },
      get soft() { return view.getFloat64(40, true); },
      get status() { return view.getUint8(48); },
      set({ seq, t_hard_ns, t_soft_ns, hard_raw, soft_raw, hard, soft, status }) {
        [seq, t_hard_ns, t_soft_ns].forEach((value, i) => view.setBigInt64(8 * i, BigInt(value), true));
        view.setInt32(24, hard_raw, true);
        view.setInt32(28, soft_raw, true);
        view.setFloat64(32, hard, true);
        view.setFloat64(40, soft, true);
        view.setUint8(48, status);
      },
    };
  }

  // Gives the samples [from, to) to the tracker; calls add(block) for each part of them.
  take(from, to, add) {
    for (let at = from; at < to; ) {
      const end = this.wasm.take(at, to), { buffer } = this.wasm.memory;
      const block = { first: 0, end, bin: 0, flags: new Uint8Array(buffer, this.wasm.flags(), end) };
      FIELDS.forEach((name, i) => (block[name] = new Float64Array(buffer, this.wasm.column(i), end)));
      add(block, this.touches());
      at += end;
    }
  }

  // The touches that ended, or were revised, since the last call of the module, in order.
  touches() {
    const size = this.wasm.touch_size(), count = this.wasm.touch_count();
    const all = new Float64Array(this.wasm.memory.buffer, this.wasm.touches(), size * count);
    return Array.from({ length: count }, (_, i) => this.touch(all.slice(size * i, size * (i + 1))));
  }

  touch(numbers) {
    const touch = Object.fromEntries(NUMBERS.map((name, i) => [name, numbers[i]]));
    const effects = Object.fromEntries(EFFECTS.map((name) => [name, touch[name]]));
    for (const name of EFFECTS) delete touch[name];
    return { ...touch, effects, revised: touch.revised === 1, flags: this.names.filter((_, bit) => touch.flags & (1 << bit)) };
  }

  get state() {
    return this.word(this.wasm.state());
  }
}
