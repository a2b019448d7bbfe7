// What the live page and docs/try have in common: instruction, status line, table and charts, of one `known`, with their keys.

import { Charts } from "./charts/charts.js";
import { $ } from "./dom.js";
import { Explain } from "./explain.js";
import { Instruction } from "./instruction.js";
import { listen } from "./keys.js";
import { remember } from "./preferences.js";
import { StatusLine } from "./status_line.js";
import { Table } from "./table.js";

const NOTHING = {
  touches: { rows: [] },
  events: { marks: [], tares: [], gaps: [], judgements: [], flags: [] },
  session: { specimens: [], notes: [] },
  calibration: {},
  device: {},
  chosen: null,
  finished: null,
  looking: null,
};
const SHOWN_AGAIN = ["hello", "touches", "session", "calibration"];

export class Shell {
  // store: Store; send(message): to the server, if there is one; actions, more: of the keys; memory: of the settings
  constructor(store, { send, actions, more = [], memory }) {
    this.known = { hello: {}, state: {}, ...NOTHING };
    this.store = store;
    this.line = new StatusLine();
    this.charts = new Charts(store, this.known, send, (kind) => this.update(kind));
    const table = new Table(this.known, send, (touch) => this.charts.choose(touch));
    this.parts = [this.line, new Instruction(), table, new Explain(this.charts)];
    const key = (name) => this.charts.key(name);
    remember(() => this.refresh(), memory);
    listen({ close: () => this.close(), ...actions }, key, more);
    $("pause").onclick = () => key(this.known.looking ? "live" : "pause");
    for (const button of document.querySelectorAll("[data-key]")) {
      button.onclick = () => key(button.dataset.key);
    }
    addEventListener("resize", () => this.charts.show());
    globalThis.palpate = this; // for the console: the numbers that are shown
  }

  // Takes a message of this kind: all parts show it. A hello of another measurement ends all that was known of the one before.
  receive(kind, message) {
    if (kind === "hello" && isOther(message, this.known.hello)) {
      Object.assign(this.known, NOTHING, { state: { ...this.known.state, end_s: null } });
      this.store.used = 0;
      this.charts.clear(message.kind === "file");
    }
    this.known[kind] = message;
    this.update(kind);
    this.charts.show(kind);
  }

  // Shows all again, after a change of the settings.
  refresh() {
    if (this.known.hello.kind) {
      for (const kind of SHOWN_AGAIN) {
        this.receive(kind, { ...this.known[kind] });
      }
    }
    this.charts.show();
  }

  update(kind) {
    for (const part of this.parts) {
      part.update(kind, this.known);
    }
  }

  close() {
    document.activeElement?.blur();
    this.charts.choose(null);
    this.charts.key("clear");
  }
}

function isOther(hello, before) {
  if (hello.measurement !== before.measurement || hello.kind !== before.kind) return true;
  return before.origin_s !== null && hello.origin_s !== before.origin_s;
}
