// The start screen: what can be done, the state of the board, and the last files.

import { $, fill, make, put } from "./dom.js";

const MOST_FILES = 5;
const OPENED = ["recording", "report"]; // kinds of files

export class Start {
  update(type, known) {
    if (type !== "state" && type !== "hello" && type !== "device") return;
    put("board", boardWords(known));
    put("trial", known.hello.simulation ? "This is a simulation already: press Measure." : "A simulated probe, and your mouse as the hand. Nothing is measured.");
    const files = (known.state.files ?? []).filter(({ kind }) => OPENED.includes(kind));
    const last = files.slice(-MOST_FILES).toReversed();
    fill($("lastfiles"), last, () => (last.length ? last.map(item) : [make("li", { textContent: "Nothing is recorded yet." })]));
    const newest = last.find(({ kind }) => kind === "recording");
    put("opencommand", `palpate live ${newest?.name ?? "FILE.csv"}`);
  }
}

function item({ name, kind }) {
  const link = make("a", { href: `recording/${encodeURIComponent(name)}`, textContent: name });
  if (kind === "recording") link.download = name;
  return make("li", {}, link);
}

function boardWords({ hello, state, offline }) {
  if (offline) return "No connection to palpate.";
  if (hello.kind === "file") return "A recording is open; nothing is measured.";
  if (hello.simulation) return "No board is connected: a simulation runs.";
  const alarmed = state.now?.tone === "fault";
  if (alarmed) return `${hello.device || hello.source}: ${state.line.title}`;
  return `${hello.device || hello.source}: ready.`;
}
