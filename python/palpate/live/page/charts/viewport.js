// The window of time that is shown: the newest seconds, or a fixed part of the measurement that is looked back at.

const LIVE_S = 30;
const LEAST_S = 0.01;
const AROUND_S = 36;

export class Viewport {
  // changed(): the window is another one.
  constructor(changed) {
    this.changed = changed;
    this.begin = this.end = 0; // of the measurement, in the source's seconds
    this.clear(false);
  }

  // file: an opened recording is shown as a whole; nothing in it is newer than the window.
  clear(file) {
    this.file = file;
    this.fixed = null;
    this.span = file ? Infinity : LIVE_S;
  }

  get from() {
    return this.fixed ? this.fixed[0] : Math.max(this.begin, this.to - this.span);
  }

  get to() {
    return this.fixed
      ? this.fixed[1]
      : Math.max(this.end, this.begin + (this.file ? LEAST_S : Math.min(this.span, LIVE_S)));
  }

  // Shows [from, to], moved into the measurement.
  show(from, to) {
    const most = Math.max(this.end - this.begin, LEAST_S);
    const span = Math.min(most, Math.max(LEAST_S, to - from));
    const first = Math.max(this.begin, Math.min(this.end - span, from + (to - from - span) / 2));
    this.fixed = [first, first + span];
    this.changed();
  }

  pan(seconds) {
    this.show(this.from + seconds, this.to + seconds);
  }

  // Makes the window `factor` times as long; the moment `at` stays where it is.
  zoom(factor, at) {
    const [from, to] = [this.from, this.to];
    const k = Math.max(factor, LEAST_S / (to - from));
    this.show(at - (at - from) * k, at + (to - at) * k);
  }

  // Shows a touch with what is around it, as near as the window was, or nearer.
  around({ start_s, end_s }) {
    const half = Math.min(this.to - this.from, Math.max(AROUND_S, 3 * (end_s - start_s))) / 2;
    const middle = (start_s + end_s) / 2;
    this.show(middle - half, middle + half);
  }

  // By a key: a window that follows goes on following.
  zoomHere(factor) {
    if (this.fixed || this.file) return this.zoom(factor, (this.from + this.to) / 2);
    const span = Math.max(LEAST_S, (this.to - this.from) * factor);
    this.span = span > this.end - this.begin && factor > 1 ? Infinity : span;
    this.changed();
  }

  live(span = this.span) {
    this.fixed = null;
    this.span = span;
    this.changed();
  }

  now() {
    this.live(this.file ? Infinity : Number.isFinite(this.span) ? this.span : LIVE_S);
  }
}
