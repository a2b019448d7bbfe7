// Record, always there; the names of recordings; all downloads in one place.

import { $, ask, fill, make, put } from "./dom.js";
import { clock, grouped, settings } from "./formatting.js";
import { asText, save } from "./table.js";

const KINDS = { recording: "samples", settings: "settings, marks and notes", calibration: "calibration", report: "report" };

export class Record {
  constructor(known, send) {
    this.known = known;
    this.send = send;
    $("record").onclick = () => this.turn();
    $("openfiles").onclick = () => ask($("files"));
    $("proposed").oninput = () => {
      this.typed = $("proposed").value.trim();
    };
    $("settings").addEventListener("close", () => this.sendSettings(true));
    $("copy").onclick = () => this.copy();
    $("csv").onclick = () => save(this.known.touches.rows, "touches.csv");
  }

  update(type, known) {
    if (type === "hello") this.sendSettings(false);
    if (type === "state" || type === "hello") this.show(known);
  }

  turn() {
    if (this.known.state.recording) this.send({ do: "stop" });
    else if (this.typed) this.send({ do: "record", name: this.typed });
    else this.send({ do: "record" });
  }

  // A report has the settings of the page that changed them last; a page without any of its own leaves them as they are.
  sendSettings(changed) {
    const { unit, shore, probe, site, operator } = settings;
    const own = unit !== "MPa" || shore === "on" || probe || site || operator;
    if (changed || own) this.send({ do: "settings", unit, shore: shore === "on", probe, site, operator });
  }

  show({ hello, state, offline }) {
    const { recording } = state;
    const [word, more, rows, end] = $("record").children;
    const file = hello.kind === "file";
    const counted = recording && !offline;
    $("record").classList.toggle("on", Boolean(recording));
    put(word, recording ? `Recording${offline ? "?" : ""}` : "Record");
    put(more, recordWords(hello, recording, offline));
    put(rows, counted ? ` · ${grouped(recording.rows)} rows` : "");
    put(end, counted ? "End" : "");
    $("record").title = recording ? recording.name : state.proposed ?? "";
    if (recording?.name === this.typed) this.typed = "";
    if (!this.typed && document.activeElement !== $("proposed")) $("proposed").value = state.proposed ?? "";
    $("proposed").disabled = file;
    const files = (state.files ?? []).toReversed();
    fill($("downloads"), files, () => (files.length ? files.map(download) : [make("li", { textContent: "Nothing is recorded yet." })]));
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

function recordWords(hello, recording, offline) {
  if (offline) return "· not known now";
  if (recording) return clock(recording.seconds ?? 0);
  if (hello.kind === "file") return "· needs a board";
  return hello.simulation ? "· as simulated" : "· nothing is recorded";
}

function download({ name, kind }) {
  const link = make("a", { href: `recording/${encodeURIComponent(name)}`, download: name, textContent: name });
  return make("li", {}, link, make("small", { textContent: KINDS[kind] }));
}
