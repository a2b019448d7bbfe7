// The simulated touches as if they were measured now.

import { Flow } from "./flow.js";
import { $ } from "./page/dom.js";

const STEP_MS = 40;
const AFTER_S = 1; // behind the last sample

export class Playing {
  // core: a promise of it; begin(measurement), rows(block), tell(kind, message); ended(): all was played
  constructor(to) {
    this.to = to;
    this.timer = null;
  }

  async start() {
    this.stop();
    const mine = (this.timer = setInterval(() => this.step(), STEP_MS));
    const got = await (await this.to.core).play();
    if (this.timer !== mine) return;
    this.flow = new Flow(got, this.to);
    this.to.begin(got);
    this.began = performance.now();
    this.dress();
  }

  step() {
    if (!this.flow) return;
    const { got } = this.flow, at_s = (performance.now() - this.began) / 1000;
    this.flow.take(got.until(at_s));
    if (at_s > got.end + AFTER_S) {
      this.stop();
      this.to.ended();
    }
  }

  stop() {
    clearInterval(this.timer);
    this.flow?.stop();
    this.timer = this.flow = null;
    this.dress();
  }

  dress() {
    $("play").setAttribute("aria-pressed", String(Boolean(this.flow)));
  }
}
