// A thin strip of both channels: one sees that the measurement lives.

import { span, trace } from "../charts/plot.js";
import { Canvas } from "../charts/canvas.js";
import { extremes } from "../charts/plot.js";
import { $ } from "../dom.js";

const LONG_S = 20; // shown
const LEAST_PF = 0.02; // height: noise alone looks quiet
const EVERY_MS = 66;
const MARGIN = 4; // px

export class Strip {
  constructor(store) {
    this.store = store;
    this.canvas = new Canvas($("strip"), () => this.draw());
    this.canvas.name = "Both channels, the newest 20 s";
  }

  update() {
    this.later();
  }

  // Rows have come: it is drawn soon, once.
  later() {
    this.timer ??= setTimeout(() => {
      this.timer = null;
      requestAnimationFrame(() => this.draw());
    }, EVERY_MS);
  }

  draw() {
    const { block, used } = this.store;
    if (document.body.dataset.depth !== "measure" || !this.canvas.begin() || !used) return;
    const end = block.t[used - 1];
    const rows = span(block, end - LONG_S, end);
    const [low, high] = extremes(block, ["hard", "soft"], rows, [0, LEAST_PF]);
    const { width, height } = this.canvas;
    const x = (t) => width - ((end - t) / LONG_S) * width;
    const y = (value) => height - MARGIN - ((value - low) / (high - low)) * (height - 2 * MARGIN);
    for (const name of ["soft", "hard"]) {
      trace(this.canvas, name, block, rows, x, y);
    }
  }
}
