// Record, always there; the names of recordings; all downloads in one place.

import { $, ask, fill, make, put } from "./dom.js";
import { clock, grouped, settings } from "./formatting.js";
import { asText, save } from "./table.js";

const KINDS = { recording: "samples", settings: "settings, marks and notes", calibration: "calibration", report: "report" };

export class Record {
  constructor(known, say) {
    Object.assign(this, { known, say });
    $("record").onclick = () => say(this.known.state.recording ? { do: "stop" } : { do: "record", ...(this.typed && { name: this.typed }) });
    $("openfiles").onclick = () => ask($("files"));
    $("proposed").oninput = () => (this.typed = $("proposed").value.trim());
    $("settings").addEventListener("close", () => this.settle(true));
    $("copy").onclick = () => this.copy();
    $("csv").onclick = () => save(this.known.touches.rows, "touches.csv");
  }

  update(type, known) {
    if (type === "hello") this.settle(false);
    if (type === "state" || type === "hello") this.show(known);
  }

  // A report has the settings of the page that changed them last; a page without any of its own leaves them as they are.
  settle(changed) {
    const { unit, shore, probe, site, operator } = settings;
    if (changed || unit !== "MPa" || shore === "on" || probe || site || operator) this.say({ do: "settings", unit, shore: shore === "on", probe, site, operator });
  }

  show({ hello, state, offline }) {
    const { recording } = state, [word, more, rows, end] = $("record").children, file = hello.kind === "file";
    $("record").classList.toggle("on", Boolean(recording));
    put(word, recording ? `Recording${offline ? "?" : ""}` : "Record");
    put(more, offline ? "· not known now" : recording ? clock(recording.seconds ?? 0) : file ? "· needs a board" : hello.simulation ? "· as simulated" : "· nothing is recorded");
    put(rows, recording && !offline ? ` · ${grouped(recording.rows)} rows` : "");
    put(end, recording && !offline ? "End" : "");
    $("record").title = recording ? recording.name : state.proposed ?? "";
    if (recording?.name === this.typed) this.typed = "";
    if (!this.typed && document.activeElement !== $("proposed")) $("proposed").value = state.proposed ?? "";
    $("proposed").disabled = file;
    const files = (state.files ?? []).toReversed();
    const link = (name) => make("a", { href: `recording/${encodeURIComponent(name)}`, download: name, textContent: name });
    const item = ({ name, kind }) => make("li", {}, link(name), make("small", { textContent: KINDS[kind] }));
    fill($("downloads"), files, () => (files.length ? files.map(item) : [make("li", { textContent: "Nothing is recorded yet." })]));
  }

  async copy() {
    const { rows } = this.known.touches;
    try {
      await navigator.clipboard.writeText(asText(rows, "\t"));
      put("filesays", `${rows.length} touches are copied.`);
    } catch {
      put("filesays", "The browser does not allow to copy here: save the table as CSV.");
    }
  }
}
