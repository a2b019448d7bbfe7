// One page, three depths: Measure, Explain and Lab, and the start screen. The address remembers which one is open.

import { $ } from "./dom.js";

export const DEPTHS = ["measure", "explain", "lab", "start"];

export class Depths {
  // changed(depth): another depth is shown; ofFile: what a recording opens
  constructor(changed, ofFile = "lab") {
    this.changed = changed;
    this.ofFile = ofFile;
    this.usual = "measure";
    for (const button of document.querySelectorAll("button[data-depth]")) {
      button.onclick = () => this.show(button.dataset.depth);
    }
    addEventListener("hashchange", () => this.follow());
    this.follow();
  }

  // What opens without a choice: a recording has its finder and its charts in the Lab.
  update(type, { hello }) {
    if (type !== "hello") return;
    this.usual = hello.kind === "file" ? this.ofFile : "measure";
    this.follow();
  }

  show(depth) {
    location.hash = depth;
    this.follow();
  }

  follow() {
    const asked = location.hash.slice(1);
    const depth = DEPTHS.includes(asked) ? asked : this.usual;
    if (depth === this.depth) return;
    this.depth = depth;
    document.body.dataset.depth = depth;
    for (const name of DEPTHS.filter($)) {
      $(name).hidden = name !== depth;
    }
    for (const button of document.querySelectorAll("button[data-depth]")) {
      button.ariaCurrent = String(button.dataset.depth === depth);
    }
    scrollTo(0, 0);
    this.changed(depth);
  }
}
