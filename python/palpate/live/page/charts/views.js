// Rows of any part of the measurement at the resolution of the screen: asked from the server, kept, and chosen from.

const EVERY_MS = 70; // fewer than 15 requests a second
const PATIENCE_MS = 3000; // then a request may have been lost with its connection
const KEPT = 24, ROWS = 4096;
const WIDER = 3; // windows in one view: a pan is drawn from it
const NEAR = 0.4; // windows before the edge of a view the next one is asked for
const COARSE = 1.5; // pixels in a bin that still count as one

export class Views {
  // say(message): to the server; changed(): a view has come.
  constructor(say, changed) {
    this.say = say;
    this.changed = changed;
    this.clear();
  }

  clear() {
    this.kept = []; // the newest used last
    this.wanted = new Map(); // purpose -> request
    this.asked = new Map(); // id -> request
    this.id = (this.id ?? 0) + 1000; // answers of an earlier measurement are not taken
    this.said ??= -EVERY_MS;
    this.sent ??= 0;
  }

  // Asks for rows of [from, to]. Of each purpose only the newest request counts.
  ask(purpose, from, to, rows) {
    rows = Math.min(Math.max(Math.round(rows), 2), ROWS);
    this.wanted.set(purpose, { purpose, from, to, rows, bin: (2 * (to - from)) / rows });
    this.timer ??= setTimeout(() => this.send(), Math.max(0, this.said + EVERY_MS - performance.now()));
  }

  send() {
    this.timer = null;
    const [request] = this.wanted.values();
    if (!request) return;
    this.wanted.delete(request.purpose);
    this.said = performance.now();
    for (const [id, { at }] of this.asked) if (this.said - at > PATIENCE_MS) this.asked.delete(id);
    const { from, to, rows } = request;
    if (this.say({ do: "view", id: ++this.id, from_s: from, to_s: to, rows }) !== false) {
      this.asked.set(this.id, { ...request, at: this.said });
      this.sent++;
    }
    if (this.wanted.size) this.timer = setTimeout(() => this.send(), EVERY_MS);
  }

  // Takes an answer. known: the newest time that the measurement had; later rows are not in the view.
  take(id, block, known) {
    const request = this.asked.get(id);
    if (!request) return;
    this.asked.delete(id);
    this.kept = this.kept.filter((one) => one.purpose !== "all" || request.purpose !== "all");
    this.kept.push({ ...request, to: Math.min(request.to, known), block: Object.assign(block, { bin: request.bin }) });
    if (this.kept.length > KEPT) this.kept.splice(this.kept.findIndex((one) => one.purpose !== "all"), 1);
    this.changed();
  }

  // The view of everything, if it is there.
  get all() {
    return this.kept.find((one) => one.purpose === "all") ?? null;
  }

  // The finest view that has all of [from, to]; else that of everything.
  best(from, to) {
    const whole = this.kept.filter((one) => one.from <= from && one.to >= to);
    const found = whole.reduce((best, one) => (best && best.bin <= one.bin ? best : one), null);
    if (found) this.kept.push(this.kept.splice(this.kept.indexOf(found), 1)[0]);
    return found ?? this.all;
  }

  // Asks for what a window of so many pixels still needs: first three times as wide, then exactly, once it stands still.
  // begin, end: of the measurement; held: from here on its rows are here anyway.
  need(from, to, pixels, still, { begin, held, end }) {
    const span = to - from, under = [...this.kept, ...this.underWay()];
    const have = (bin, a, b) => under.some((one) => one.bin <= bin && one.from <= Math.max(a, begin) && one.to >= Math.min(b, held) - 1e-9);
    const ask = (purpose, a, b) => this.ask(purpose, Math.max(a, begin), Math.min(b, end), ROWS);
    const exact = (2 * span) / ROWS, margin = ((WIDER - 1) / 2) * span;
    if (!have(WIDER * exact * COARSE, from - NEAR * span, to + NEAR * span)) ask("window", from - margin, to + margin);
    else if (still && !have(Math.max(span / pixels, exact) * COARSE, from, to)) ask("pixels", from, to);
  }

  underWay() {
    const now = performance.now();
    return [...this.asked.values(), ...this.wanted.values()].filter(({ at = now }) => now - at < PATIENCE_MS);
  }
}
