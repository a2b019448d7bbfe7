// The start screen: measure, open a recording, try without a probe. The server opens what is chosen in place of what is shown.

import { $, fill, make, put } from "./dom.js";

export class Start {
  // open(what): "measure", "demo", or the name of a recording that the server has listed
  constructor(open) {
    this.open = open;
    $("startmeasure").onclick = () => open("measure");
    $("startdemo").onclick = () => open("demo");
  }

  update(type, known) {
    if (type === "state" || type === "hello") put("board", boardWords(known));
    if (type !== "recordings") return;
    const { files } = known.recordings;
    fill($("recordings"), files, () => files.map((file) => this.item(file)));
    $("norecordings").hidden = files.length > 0;
  }

  item({ name, changed_s: changed }) {
    const time = new Date(1000 * changed).toLocaleString([], { dateStyle: "medium", timeStyle: "short" });
    const button = make("button", { type: "button" }, make("b", { textContent: name }), make("span", { textContent: time }));
    button.onclick = () => this.open(name);
    return make("li", {}, button);
  }
}

function boardWords({ hello, state, offline }) {
  if (offline) return "No connection to palpate.";
  if (hello.kind === "file") return "A recording is shown. Measure looks for the board.";
  if (hello.source?.startsWith("demo:")) return "The demo is shown. Measure looks for the board.";
  const device = hello.simulation ? hello.source : hello.device || hello.source;
  if (state.now?.tone === "fault") return `${device}: ${state.line.title}`;
  return `${device}: ready.`;
}
