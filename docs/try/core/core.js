// The core of palpate in a browser: recordings, a serial port, and the simulated session. No part of it knows the page.

import { Measurement } from "./measurement.js";
import { Module } from "./module.js";
import { recordingOf } from "./recording.js";
import { Refused } from "./refused.js";
import { sampled, samplesOf, text } from "./simulated.js";
import { Serial } from "./serial.js";
import { TABLES } from "./tables.js";

export { Refused };

export async function load(bytes) {
  return new Core(await WebAssembly.compile(bytes));
}

class Core {
  constructor(compiled) {
    this.compiled = compiled;
  }

  // The dropped files, [{ name, bytes }]: a recording, and its sidecar.
  async open(files) {
    return recordingOf(await Module.of(this.compiled), files);
  }

  // The simulated session as a recording; `truth` says what was touched.
  async sample() {
    return sampled(await this.open([{ name: "simulated.csv", bytes: text(await samplesOf()) }]));
  }

  // The same, as it would come from a board: until(t_s) gives the rows up to a time.
  async play() {
    const module = await Module.of(this.compiled), samples = await samplesOf();
    const settings = { ...TABLES.scenes.handheld, full_scale: TABLES.full_scale_pF };
    const got = sampled(new Measurement(module, { kind: "live", name: "simulated touches", settings }));
    let at = 0;
    got.until = (t_s) => {
      const begin = at;
      while (at < samples.length && Number(samples[at].t_hard_ns) <= t_s * 1e9) at += 1;
      return got.feed(samples.slice(begin, at));
    };
    return got;
  }

  // A port that sends labelled lines.
  async serial(name) {
    return new Serial(await Module.of(this.compiled), name);
  }
}
