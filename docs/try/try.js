// palpate in a browser alone: the core in WebAssembly behind the charts and tables of the live page.

import { Core, Refused } from "./core.js";
import packed from "./palpate.wasm.gz";
import demoRows from "./demo.csv.gz";
import demoSidecar from "./demo.json.gz";
import { $, make, put } from "./page/dom.js";
import { Screen } from "./page/screen.js";
import { Store } from "./page/store.js";
import { Port, RATES, unsupported } from "./port.js";
import { recordingOf } from "./recording.js";
import { Serial } from "./serial.js";

const MOST_BYTES = 3e8; // of a recording
const SILENT_S = 3, TELL_MS = 200;
const STAYS = "What was measured stays here until something else is opened.";
const DEMO = {
  now: { word: "Demo", sub: "simulated touches: nothing is measured", tone: "idle", share: null },
  line: { level: "note", title: "This is a simulation.", text: "A hard and a soft bump press on rubber: their ratio tells how elastic it is. Drop a recording, or connect your probe." },
};
const KEYS = [["O", "Open a recording", "open"], ["C", "Connect a serial port, or end it", "connect"]];

for (const id of ["noise", "going", "step"]) $(id).remove(); // what needs the server of palpate live
const store = new Store(Infinity); // all rows
const screen = new Screen(store, { more: KEYS, memory: {} }); // it stores nothing
const { known, line, charts } = screen;
const compiled = unpacked(packed).then((bytes) => WebAssembly.compile(bytes));
let measurements = 0, current = null, port = null, later = null;

async function unpacked(bytes) {
  return new Uint8Array(await new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer());
}

// Shows a measurement from its begin.
function show(got) {
  current = got;
  line.down = null;
  const file = got.kind === "file";
  document.body.classList.toggle("file", file);
  $("tare").hidden = $("pause").hidden = file;
  screen.hear("hello", { ...got.hello, measurement: ++measurements });
  put("source", [...new Set([got.name, got.device, got.scene])].filter(Boolean).join(" · "));
  follow(got);
  tell(got);
}

// Shows the rows that came.
function follow(got) {
  for (const block of got.parts.splice(0)) store.add(block);
  if (known.hello.origin_s === null) screen.hear("hello", { ...known.hello, origin_s: got.origin });
  charts.frame();
}

// Shows what is known, and `more` that the port says.
function tell(got, more = {}) {
  clearTimeout(later);
  later = null;
  for (const kind of ["session", "events", "touches"]) screen.hear(kind, got[kind]);
  screen.hear("state", { ...got.state, ...more });
  $("found").hidden = !got.messages.length;
  $("messages").replaceChildren(...got.messages.map((textContent) => make("li", { textContent })));
}

// Opens dropped files; reports a file that cannot be read, and keeps what was shown.
async function open(files) {
  if (!files.length) return said("Nothing to open", "What was dropped is no file. Drop run.csv of palpate with its run.json.");
  if (port) return said("A port is connected", "Disconnect it first: the measurement would end, and this page records nothing.");
  const names = files.map(({ name }) => name).join(", "), size = files.reduce((sum, file) => sum + file.size, 0);
  if (size > MOST_BYTES) return said("Too large for this page", `${(size / 1e6).toFixed(0)} MB, at most ${MOST_BYTES / 1e6} MB are read here. palpate live FILE reads it.`);
  line.answer(`Reading ${names} …`);
  try {
    const read = await Promise.all(files.map(async (file) => ({ name: file.name, bytes: new Uint8Array(await file.arrayBuffer()) })));
    const got = recordingOf(await Core.of(await compiled), read);
    if (!port) show(got);
  } catch (error) {
    failed(`${names}: not opened`, error);
  }
  line.answer("");
}

async function demo() {
  const [rows, sidecar] = await Promise.all([demoRows, demoSidecar].map(unpacked));
  const got = recordingOf(await Core.of(await compiled), [{ name: "demo.csv", bytes: rows }, { name: "demo.json", bytes: sidecar }]);
  if (current) return; // the visitor was faster
  show(Object.assign(got, { name: "simulated touches" }));
  screen.hear("state", { ...known.state, ...DEMO });
}

async function connect() {
  if (port) return port.stop();
  const baud = Number($("baud").value);
  port = new Port();
  let got = null;
  try {
    await port.open(baud);
    got = new Serial(await Core.of(await compiled), port.name);
    show(got);
    dress();
    line.answer("This page records nothing. palpate live does.");
    await measure(got, baud);
  } catch (error) {
    if (error.name === "NotFoundError") line.answer("No port was chosen.");
    else failed(got ? "The measurement has ended" : "The port was not opened", error);
    if (got) end(got, "fault", "The measurement has ended.", `${error.message}. ${STAYS}`);
  }
  await port.close();
  port = null;
  dress();
}

// Takes what the port sends until it ends.
async function measure(got, baud) {
  let heard_s = performance.now() / 1000;
  const watch = setInterval(() => {
    const silent = performance.now() / 1000 - heard_s > SILENT_S;
    line.down = silent ? { title: "No data.", text: `The port sends nothing. Look at its plug, its cable, and the rate: ${baud} baud.` } : null;
    line.show(known);
  }, 500);
  try {
    for await (const { chunk, lost } of port.chunks()) {
      heard_s = performance.now() / 1000;
      if (lost) line.answer(`The port lost characters (${lost}): a line or more is missing.`, true);
      else got.hear(chunk, heard_s);
      follow(got);
      later ??= setTimeout(() => tell(got), TELL_MS);
    }
  } finally {
    clearInterval(watch);
    line.down = null;
  }
  if (port.asked) end(got, "note", "Disconnected.", STAYS);
  else end(got, "fault", "The port is gone.", `Look at its plug, and connect it again. ${STAYS}`);
}

function end(got, level, title, text) {
  got.close(title);
  got.messages.push(title);
  follow(got);
  tell(got, { line: { level, title, text }, announce: `${title} ${text}` });
}

function tare() {
  if (current.tare()) line.answer("Measuring the baseline: do not touch anything.");
  else line.answer("tare: got it while the probe is in contact, allowed: without contact. Lift the probe", true);
}

// A refusal is for the visitor; what else the browser throws is a fault of this page, or of it.
function failed(title, error) {
  const meant = error instanceof Refused;
  said(title, meant ? error.message : `This page or the browser failed: ${error.name}, ${error.message}. palpate live does without it.`);
  if (!meant) console.error(error);
}

// A sentence that needs room, until it is closed.
function said(title, text) {
  put("saidtitle", title);
  put("saidtext", text);
  if (!$("said").open) $("said").showModal();
}

function dress() {
  $("connect").classList.toggle("on", Boolean(port));
  $("connect").firstChild.textContent = port ? "Disconnect" : "Connect";
  $("open").disabled = Boolean(port);
  $("tare").disabled = !port;
}

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
$("baud").append(...RATES.map((rate) => new Option(rate, rate, rate === 115200, rate === 115200)));
$("connect").disabled = Boolean(unsupported());
$("connect").title = $("noport").textContent = unsupported();
$("noport").hidden = !unsupported();
$("connect").onclick = connect;
$("tare").onclick = tare;
addEventListener("beforeunload", (event) => port && event.preventDefault()); // the browser asks
demo().catch((error) => failed("The page does not work", error));
