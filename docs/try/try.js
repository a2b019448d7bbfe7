// palpate in a browser alone: the core in WebAssembly behind the charts and tables of the live page.

import { Refused, load } from "./core.js";
import packed from "./palpate.wasm.gz";
import { Charts } from "./page/charts/charts.js";
import { $, make, put } from "./page/dom.js";
import { Keys } from "./page/keys.js";
import { Line } from "./page/line.js";
import { Now } from "./page/now.js";
import { Store } from "./page/store.js";
import { Table } from "./page/table.js";
import { Theme } from "./page/theme.js";
import { Dropping, told } from "./files.js";
import { Measuring } from "./measuring.js";
import { Playing } from "./playing.js";
import { Truth, compared } from "./truth.js";

const KINDS = ["hello", "session", "events", "touches", "state"];
const NOWHERE = { remember: () => {}, remembered: () => null }; // this page stores nothing
const known = { hello: {}, state: {}, session: { specimens: [] }, events: { marks: [] }, touches: { rows: [] }, calibration: {}, device: {}, looking: null, chosen: null, truth: null };

const store = new Store(Infinity), line = new Line();
const charts = new Charts(document, store, () => false);
const parts = [line, new Now(), new Table(null, (touch) => charts.choose(touch)), new Truth()];
const core = unpacked().then(load);
let shown = 0; // measurements so far
let newest = 0; // the last one that was asked for: what comes of an earlier one is not shown

const live = { core, begin: show, rows, tell: hear };
const playing = new Playing({ ...live, ended: simulate });
const measuring = new Measuring({
  ...live,
  begin: (got) => {
    playing.stop();
    newest++;
    show(got);
  },
  answer: (text, bad) => line.answer(text, bad),
  failed,
  down: (fault) => {
    line.down = fault;
    line.show(known);
  },
});
new Theme(() => charts.dress(), NOWHERE);
new Keys({ pause: () => $("pause").hidden || charts.key(known.looking ? "live" : "pause"), close }, (name) => charts.key(name), [["O", "Open a recording", "open"], ["C", "Connect a serial port, or end it", "connect"], ["I", "Simulated touches", "simulate"], ["V", "Play them as if they were measured now", "play"]]);
new Dropping(open);

// The core came with the page, packed.
async function unpacked() {
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

function show(got) {
  store.clear();
  line.down = null;
  known.chosen = null;
  known.truth = got.truth ?? null;
  document.body.classList.toggle("simulated", Boolean(known.truth));
  document.body.classList.toggle("file", got.hello.kind === "file");
  $("tare").hidden = got.hello.kind === "file" || Boolean(known.truth);
  $("pause").hidden = got.hello.kind === "file";
  const begin = got.hello.origin_s ?? null;
  hear("hello", { ...got.hello, measurement: ++shown, origin_s: got.block.end ? got.block.t[0] : begin });
  store.add(got.block);
  for (const kind of KINDS.slice(1)) hear(kind, got[kind]);
  charts.frame();
}

// Further rows of a measurement that goes on.
function rows(block) {
  store.add(block);
  if (known.hello.origin_s === null) hear("hello", { ...known.hello, origin_s: store.origin });
  charts.frame();
}

function hear(kind, told_it) {
  const message = known.truth ? compared(kind, told_it, known.truth) : told_it;
  known[kind] = message;
  for (const part of parts) part.tell(kind, known);
  charts.tell(kind, message);
  if (kind === "hello") put("source", sourceOf(message));
  if (kind === "state") list(message.messages ?? []);
}

function sourceOf({ file, source, device, scene }) {
  const name = file?.name ?? source;
  return [name, name.includes(device) ? "" : device, scene].filter(Boolean).join(" · ");
}

function list(messages) {
  $("found").hidden = !messages.length;
  if ($("messages").children.length !== messages.length) $("messages").replaceChildren(...messages.map((textContent) => make("li", { textContent })));
}

// Shows what is made; what fails is said, and what was shown stays.
async function opened(name, make_it) {
  const mine = ++newest;
  if (measuring.on) return told("A port is connected", "Disconnect it first: the measurement would end, and this page records nothing.");
  line.answer(`Reading ${name} …`);
  try {
    const got = await make_it(await core);
    if (mine === newest && !measuring.on) {
      playing.stop();
      show(got);
    }
    line.answer("");
  } catch (error) {
    line.answer("");
    if (mine === newest) failed(`${name}: not opened`, error);
  }
}

function open(files) {
  return opened(files.map(({ name }) => name).join(", "), async (ready) => ready.open(await Promise.all(files.map(read))));
}

async function read(file) {
  try {
    return { name: file.name, bytes: new Uint8Array(await file.arrayBuffer()) };
  } catch (error) {
    throw new Error(`${file.name}: it cannot be read (${error.message}). Is it a folder, or was it taken away?`);
  }
}

function simulate() {
  return opened("the simulation", (ready) => ready.sample());
}

// A sentence that was made for the visitor stands as it is; what the browser throws is a fault of this page, or of it.
function failed(title, error) {
  const meant = error.constructor === Error || error instanceof Refused;
  told(title, meant ? error.message : `This page or the browser failed: ${error.name}, ${error.message}. palpate live does without it.`);
  if (!meant) console.error(error);
}

function close() {
  document.activeElement?.blur();
  charts.choose(null);
  charts.key("clear");
}

$("simulate").onclick = simulate;
$("play").onclick = () => (playing.flow ? simulate() : measuring.on || playing.start().catch((error) => failed("Not played", error)));
$("tare").onclick = () => measuring.tare();
$("pause").onclick = () => charts.key(known.looking ? "live" : "pause");
for (const button of document.querySelectorAll("[data-key]")) button.onclick = () => charts.key(button.dataset.key);
document.addEventListener("looking", () => {
  known.looking = charts.looking;
  $("pause").firstChild.textContent = known.looking ? "Live " : "Pause ";
  line.show(known);
});
document.addEventListener("chosen", ({ detail }) => {
  known.chosen = detail;
  for (const part of parts) part.tell("chosen", known);
});
addEventListener("resize", () => charts.dress());
simulate();
globalThis.palpate = { charts, known, store, measuring }; // for the console: the numbers that are shown
