// palpate in a browser alone: the core in WebAssembly behind the charts and tables of the live page.

import { Core, Refused } from "./core.js";
import packed from "./palpate.wasm.gz";
import demoRows from "./demo.rows.gz";
import demoSidecar from "./demo.json.gz";
import { GIVEN } from "./given.js";
import { Depths } from "./page/depths.js";
import { $, make, put } from "./page/dom.js";
import { Instrument } from "./page/measure/instrument.js";
import { Scale } from "./page/measure/scale.js";
import { Shell } from "./page/shell.js";
import { Store } from "./page/store.js";
import { recordingOf } from "./recording.js";

const MOST_BYTES = 3e8; // of a recording
const DEMO = {
  line: {
    level: "note",
    title: "This is a simulation.",
    text: "A hard and a soft bump press on rubber: their ratio tells how elastic it is. Drop a recording of yours.",
  },
};
const KEYS = [["O", "Open a recording", "open"]];

for (const id of ["noise", "going", "step"]) $(id).remove(); // what needs the server of palpate live
const store = new Store(Infinity); // all rows
const actions = { depth: (name) => depths.show(name) };
const shell = new Shell(store, { actions, more: KEYS, memory: {} }); // it stores nothing
const { known, line, charts } = shell;
shell.parts.push(new Instrument(), new Scale(), { update: showPage });
const depths = new Depths(() => {
  shell.update("depth");
  charts.show();
}, "measure");
const compiled = unpacked(packed).then((bytes) => WebAssembly.compile(bytes));
let measurements = 0;

async function unpacked(bytes) {
  return new Uint8Array(
    await new Response(
      new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip")),
    ).arrayBuffer(),
  );
}

// Shows a recording.
function show(got) {
  shell.receive("hello", { ...got.hello, measurement: ++measurements });
  put("source", [...new Set([got.name, got.device, got.scene])].filter(Boolean).join(" · "));
  for (const block of got.parts.splice(0)) store.add(block);
  charts.frame();
  for (const kind of ["session", "events", "touches", "state"]) shell.receive(kind, got[kind]);
  depths.update("hello", known);
  $("found").hidden = !got.messages.length;
  $("messages").replaceChildren(...got.messages.map((textContent) => make("li", { textContent })));
}

// Which touch is shown in Measure, and the way to its neighbours.
function showPage() {
  const { touch } = charts;
  const { length } = known.touches.rows;
  put("page", touch ? `Touch ${touch.number} of ${length}` : "No touch");
  $("former").disabled = !charts.neighbour(-1);
  $("latter").disabled = !charts.neighbour(1);
}

// Opens dropped files; reports a file that cannot be read, and keeps what was shown.
async function open(files) {
  if (!files.length)
    return said(
      "Nothing to open",
      "What was dropped is no file. Drop run.csv of palpate with its run.json.",
    );
  const names = files.map(({ name }) => name).join(", ");
  const size = files.reduce((sum, file) => sum + file.size, 0);
  if (size > MOST_BYTES)
    return said(
      "Too large for this page",
      `${(size / 1e6).toFixed(0)} MB, at most ${MOST_BYTES / 1e6} MB are read here. palpate live FILE reads it.`,
    );
  line.answer(`Reading ${names} …`);
  try {
    const read = await Promise.all(
      files.map(async (file) => ({
        name: file.name,
        bytes: new Uint8Array(await file.arrayBuffer()),
      })),
    );
    show(recordingOf(await Core.of(await compiled), read));
  } catch (error) {
    failed(`${names}: not opened`, error);
  }
  line.answer("");
}

// The demo as it was recorded: its columns in pF follow from its codes.
function recordedDemo(rows) {
  const { zero, per_pF } = GIVEN.codes;
  const lines = new TextDecoder()
    .decode(rows)
    .split("\n")
    .map((line) => {
      const [seq, hard_s, soft_s, hard, soft, ...rest] = line.split(",");
      const changes = [hard, soft].map((code) => (code - zero) / per_pF);
      return [seq, hard_s, soft_s, hard, soft, ...changes, ...rest].join(",");
    });
  return new TextEncoder().encode([GIVEN.headers[0], ...lines, ""].join("\n"));
}

async function demo() {
  const [rows, sidecar] = await Promise.all([demoRows, demoSidecar].map(unpacked));
  const got = recordingOf(await Core.of(await compiled), [
    { name: "demo.csv", bytes: recordedDemo(rows) },
    { name: "demo.json", bytes: sidecar },
  ]);
  if (measurements) return; // the visitor was faster
  show(Object.assign(got, { name: "simulated touches" }));
  shell.receive("state", { ...known.state, ...DEMO });
}

// A refusal is for the visitor; what else the browser throws is a fault of this page, or of it.
function failed(title, error) {
  const meant = error instanceof Refused;
  said(
    title,
    meant
      ? error.message
      : `This page or the browser failed: ${error.name}, ${error.message}. palpate live does without it.`,
  );
  if (!meant) console.error(error);
}

// A sentence that needs room, until it is closed.
function said(title, text) {
  put("saidtitle", title);
  put("saidtext", text);
  if (!$("said").open) $("said").showModal();
}

$("former").onclick = () => charts.step(-1);
$("latter").onclick = () => charts.step(1);
$("open").onclick = () => $("files").click();
$("files").onchange = () => {
  open([...$("files").files]);
  $("files").value = ""; // the same file may be chosen again
};
addEventListener("dragover", (event) => event.preventDefault());
addEventListener("drop", (event) => {
  event.preventDefault();
  open([...(event.dataTransfer?.files ?? [])]);
});
demo().catch((error) => failed("The page does not work", error));
