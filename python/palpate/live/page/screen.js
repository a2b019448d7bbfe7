// What the live page and docs/try have in common: state, line, table and charts, of one `known`, with their keys.

import { Charts } from "./charts/charts.js";
import { $ } from "./dom.js";
import { Keys } from "./keys.js";
import { Line } from "./line.js";
import { Now } from "./now.js";
import { Theme } from "./preferences.js";
import { Table } from "./table.js";

const NOTHING = {
  touches: { rows: [] }, events: { marks: [], tares: [], gaps: [], flags: [] }, session: { specimens: [], notes: [] }, calibration: {}, device: {}, chosen: null,
};

export class Screen {
  // store: Store; say(message): to the server; change: the same for the table, null if nothing can be changed; others: further
  // charts, name -> class; acts, more: of Keys; memory: of Theme
  constructor(store, { say, change = null, others = {}, acts = {}, more = [], memory }) {
    this.known = { hello: {}, state: {}, looking: null, ...NOTHING };
    this.store = store;
    this.line = new Line();
    this.charts = new Charts(store, this.known, say, others);
    this.parts = [this.line, new Now(), new Table(change, (touch) => this.charts.choose(touch))];
    const key = (name) => this.charts.key(name), pause = () => $("pause").hidden || key(this.known.looking ? "live" : "pause");
    new Theme(() => this.charts.dress(), memory);
    new Keys({ pause, close: () => this.close(), ...acts }, key, more);
    $("pause").onclick = pause;
    for (const button of document.querySelectorAll("[data-key]")) button.onclick = () => key(button.dataset.key);
    addEventListener("resize", () => this.charts.dress());
    globalThis.palpate = this; // for the console: the numbers that are shown
    document.addEventListener("looking", () => this.look(this.charts.window.back));
    document.addEventListener("chosen", () => this.tell("chosen"));
  }

  // Takes a message of this kind: all parts show it. A hello of another measurement ends all that was known of the one before.
  hear(kind, message) {
    if (kind === "hello" && isOther(message, this.known.hello)) {
      Object.assign(this.known, NOTHING, { state: { ...this.known.state, end_s: null } });
      this.store.clear();
      this.charts.clear(message.kind === "file");
    }
    this.known[kind] = message;
    this.tell(kind);
    this.charts.tell(kind, message);
  }

  tell(kind) {
    for (const part of this.parts) part.tell(kind, this.known);
  }

  look(looking) {
    this.known.looking = looking;
    document.body.classList.toggle("looking", Boolean(looking));
    $("pause").firstChild.textContent = looking ? "Live " : "Pause ";
    this.line.show(this.known);
  }

  close() {
    document.activeElement?.blur();
    this.charts.choose(null);
    this.charts.key("clear");
  }
}

function isOther(hello, before) {
  return hello.measurement !== before.measurement || hello.kind !== before.kind || (before.origin_s !== null && hello.origin_s !== before.origin_s);
}
