// What happened in the measurement: touches, marks, tares, gaps, flags, and the traces of touches, as the server tells them.

export class Tale {
  constructor() {
    this.clear();
  }

  clear() {
    this.touches = []; // completed ones
    this.running = this.next = this.uncertainty = null; // the touch that goes on, its specimen, and that of its ratio
    this.traces = new Map(); // touch -> { t, ratio, error, statistic }
    this.events = { marks: [], tares: [], gaps: [], flags: [] };
  }

  get marks() {
    return this.events.marks;
  }

  get tares() {
    return this.events.tares;
  }

  get gaps() {
    return this.events.gaps;
  }

  get all() {
    return this.running ? [...this.touches, this.running] : this.touches;
  }

  touch(number) {
    return this.touches.find((one) => one.number === number) ?? null;
  }

  // The touch at a moment, or one that is not further away than `near`.
  touchAt(t, near = 0) {
    return this.all.find(({ start_s, end_s }) => start_s <= t && t <= end_s) ?? this.all.find(({ start_s, end_s }) => start_s - near <= t && t <= end_s + near) ?? null;
  }

  // Flags that arose in a touch, with their sentences.
  flagsOf(number) {
    return this.events.flags.filter(({ touch }) => touch === number);
  }

  // Sentences for what is at a moment, or `near` it.
  said(t, near) {
    const touch = this.touchAt(t, near), close = (at) => Math.abs(at - t) <= near;
    return [
      touch ? [`touch ${touch.number}`, touch.specimen, touch.kept ? null : `left out: ${touch.why}`].filter(Boolean).join(", ") : null,
      ...this.gaps.filter(({ from_s, to_s }) => from_s - near <= t && t <= to_s + near).map(({ lost, text }) => text || `gap, ${lost} lost`),
      ...this.marks.filter(({ t_s }) => close(t_s)).map(({ text }) => text || "mark"),
      ...(this.tares.some(close) ? ["tare"] : []),
      ...this.events.flags.filter(({ t_s }) => close(t_s)).map(({ text }) => text),
    ].filter(Boolean);
  }

  counted() {
    const out = this.touches.filter(({ kept }) => !kept).length, many = (n, word) => `${n} ${word}${n === 1 ? "" : "s"}`;
    return [`${many(this.touches.length, "touch").replace("touchs", "touches")}${out ? ` (${out} left out)` : ""}`, many(this.marks.length, "mark"), many(this.gaps.length, "gap"), many(this.tares.length, "tare")].join(", ");
  }
}
