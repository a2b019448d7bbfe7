// A measurement at a serial port: its bytes go to the core as they come, its rows to the charts.

import { Flow } from "./flow.js";
import { $ } from "./page/dom.js";
import { Port, RATES, unsupported } from "./port.js";

const SILENT_S = 3;
const MOST_ROWS = 2e6; // 100 MB: 14 hours at 38 pairs a second
const STAYS = "What was measured stays here until something else is opened.";

export class Measuring {
  // core: a promise of it; begin(measurement), rows(block), tell(kind, message): what is new; answer(text, bad): for some
  // seconds; failed(title, error); down(fault or null): what is wrong with the port now
  constructor(on) {
    this.to = on;
    this.flow = null;
    this.port = null;
    this.most = MOST_ROWS;
    const why = unsupported();
    $("connect").disabled = Boolean(why);
    $("connect").title = $("noport").textContent = why;
    $("noport").hidden = !why;
    $("baud").append(...RATES.map((rate) => new Option(rate, rate, rate === 115200, rate === 115200)));
    $("connect").onclick = () => (this.port ? this.port.stop() : this.connect());
    addEventListener("beforeunload", (event) => this.on && event.preventDefault()); // the browser asks
  }

  get on() {
    return Boolean(this.port);
  }

  async connect() {
    const port = new Port(), baud = Number($("baud").value);
    this.port = port;
    try {
      await port.open(baud);
    } catch (error) {
      this.port = null;
      if (error.name === "NotFoundError") return this.to.answer("No port was chosen.");
      return this.to.failed("The port was not opened", error);
    }
    try {
      await this.measure(port, baud);
    } catch (error) {
      this.to.failed("The measurement has ended", error);
      this.end("fault", "The measurement has ended.", `${error.message}. ${STAYS}`);
    } finally {
      await port.close();
      this.port = null;
      this.dress();
    }
  }

  async measure(port, baud) {
    this.flow = new Flow(await (await this.to.core).serial(port.name), this.to);
    this.rows = 0;
    this.to.begin(this.flow.got);
    this.dress();
    this.to.answer("This page records nothing. palpate live does.");
    this.heard_s = performance.now() / 1000;
    const watch = setInterval(() => this.listen(baud), 500);
    try {
      for await (const { chunk, lost } of port.chunks()) {
        if (lost) this.to.answer(`The port lost characters (${lost}): a line or more is missing.`, true);
        else this.take(chunk);
      }
    } finally {
      clearInterval(watch);
      this.to.down(null);
    }
    if (this.rows >= this.most) this.end("caution", "This page is full.", `It keeps ${this.most} pairs at most; palpate live has no such limit. ${STAYS}`);
    else if (port.asked) this.end("note", "Disconnected.", STAYS);
    else this.end("fault", "The port is gone.", `Look at its plug, and connect it again. ${STAYS}`);
  }

  take(chunk) {
    const at_s = performance.now() / 1000;
    const block = this.flow.got.take(chunk, at_s);
    this.heard_s = at_s;
    this.rows += block.end;
    this.flow.take(block);
    if (this.rows >= this.most) this.port.stop();
  }

  // Whether something comes at all.
  listen(baud) {
    const silent = performance.now() / 1000 - this.heard_s > SILENT_S;
    if (silent) this.to.down({ title: "No data.", text: `The port sends nothing. Look at its plug, its cable, and the rate: ${baud} baud.` });
    else if (this.silent) this.to.down(null);
    this.silent = silent;
  }

  end(level, title, text) {
    if (!this.flow) return;
    this.flow.take(this.flow.got.close(title));
    this.flow.tell({ line: { what: "ended", level, title, text, since_s: null }, announce: `${title} ${text}`, messages: [title] });
    this.flow = null;
  }

  tare() {
    try {
      this.flow?.got.tare();
      this.to.answer("Measuring the baseline: do not touch anything.");
    } catch (error) {
      this.to.answer(error.message, true);
    }
  }

  dress() {
    $("connect").classList.toggle("on", this.on);
    $("connect").firstChild.textContent = this.on ? "Disconnect" : "Connect";
    for (const id of ["open", "simulate", "play"]) $(id).disabled = this.on;
    $("tare").disabled = !this.on;
  }
}
