// Puts the parts of the page together. The measurement never waits for the page.

import { Calibrating } from "./calibration.js";
import { Charts } from "./charts/charts.js";
import { FitPlot } from "./charts/fitplot.js";
import { Spectrum } from "./charts/spectrum.js";
import { Connection } from "./connection.js";
import { Device } from "./device.js";
import { $ } from "./dom.js";
import { Keys } from "./keys.js";
import { Line } from "./line.js";
import { Marks } from "./marks.js";
import { Now, running } from "./now.js";
import { Plan } from "./plan.js";
import { Record } from "./record.js";
import { Session } from "./session.js";
import { Signals } from "./signals.js";
import { Store } from "./store.js";
import { Table } from "./table.js";
import { Theme } from "./theme.js";

const CONFIRMED = 4; // every fourth frame; the server sends 30 more at most
const KEPT = ["hello", "state", "touches", "events", "session", "calibration", "device"];
const SILENT = ["trace", "view", "noise", "seen"]; // asked for by the charts, not by a person
const NOTHING = { touches: { rows: [] }, events: { marks: [] }, session: { specimens: [], notes: [] }, calibration: {}, device: {} };
const known = { hello: {}, state: {}, looking: null, chosen: null, ...NOTHING };

const store = new Store();
const line = new Line();
const answer = (text, bad) => line.answer(text, bad);
const connection = new Connection({
  up: () => link(null),
  down: (what, advice) => link({ title: sentence(what), text: sentence(advice) }),
  frame: (buffer) => {
    const frame = store.take(buffer);
    if (frame !== undefined && frame % CONFIRMED === 0) connection.say({ do: "seen", frame });
    charts.frame();
  },
  text: hear,
});
const charts = new Charts(document, store, (message) => connection.say(message), { fitplot: FitPlot, spectrum: Spectrum });
const marks = new Marks(say), session = new Session(say);
const parts = [line, new Now(), new Table(say, (touch) => charts.choose(touch)), session, new Plan(say, answer), marks, new Device(say), new Calibrating(say), new Record(say), new Signals(), { tell: enable }];
new Theme(() => charts.dress());
new Keys({ next: () => session.next(), pause: () => charts.key(known.looking ? "live" : "pause"), close }, (name) => charts.key(name));

const ANSWERS = {
  done: (message) => {
    known.forced &&= message.do !== "tare anyway";
    if (!SILENT.includes(message.do)) answer(message.message);
    if (message.do === "mark") marks.made(message);
  },
  refused: (message) => {
    answer(message.message, true);
    known.forced = message.message.startsWith("tare:");
    enable("state");
  },
  failed: (message) => answer(message.message, true),
};

function hear(message) {
  const { type } = message;
  if (type === "hello" && known.hello.measurement !== message.measurement) {
    Object.assign(known, NOTHING, { chosen: null });
    store.clear();
  }
  ANSWERS[type]?.(message);
  if (KEPT.includes(type)) {
    known[type] = message;
    tell(type);
  }
  charts.tell(type, message);
}

function tell(type) {
  for (const part of parts) part.tell(type, known);
}

function say(message) {
  const sent = connection.say(message);
  if (!sent) answer("Not connected: the command was not sent.", true);
  return sent;
}

function sentence(text) {
  return `${text.charAt(0).toUpperCase()}${text.slice(1)}.`;
}

function link(down) {
  line.down = down;
  document.body.dataset.up = down ? "no" : "yes";
  line.show(known);
  enable("state");
}

// What can be done now.
function enable(type) {
  if (type !== "state" && type !== "hello") return;
  const up = !line.down, file = known.hello.kind === "file", ended = known.state.state === "ended";
  const measuring = up && !file && !ended;
  document.body.classList.toggle("file", file);
  $("tare").hidden = ended && !file;
  $("again").hidden = !ended || file;
  $("again").disabled = !up;
  known.forced &&= known.state.state !== "no contact";
  const anyway = known.forced || known.state.line?.what === "endless", { tone, word } = known.state.now ?? {};
  $("tare").firstChild.textContent = anyway ? "Tare anyway " : "Tare ";
  $("tare").disabled = !measuring || (!anyway && (running(known.state) || tone === "fault") && word !== "Tare");
  $("pause").disabled = file;
  $("mark").disabled = $("record").disabled = !measuring;
  if (known.state.recording && up) $("record").disabled = false;
  if ($("source").textContent !== sourceOf(known)) $("source").textContent = sourceOf(known);
}

function sourceOf({ hello, state }) {
  return [hello.file?.name, hello.device || hello.source, hello.scene, state.recording?.name].filter(Boolean).join(" · ");
}

function close() {
  if (!$("marking").hidden) return marks.close();
  document.activeElement?.blur();
  menu(false);
  charts.choose(null);
  charts.key("clear");
}

function menu(open) {
  document.body.classList.toggle("menu", open);
  $("more").setAttribute("aria-expanded", String(open));
}

$("tare").onclick = () => say({ do: $("tare").textContent.startsWith("Tare anyway") ? "tare anyway" : "tare" });
$("again").onclick = () => say({ do: "again" });
$("pause").onclick = () => charts.key(known.looking ? "live" : "pause");
$("more").onclick = () => menu(!document.body.classList.contains("menu"));
$("menu").onclick = () => menu(false);
$("closenoise").onclick = () => charts.key("spectrum");
for (const button of document.querySelectorAll("[data-key]")) button.onclick = () => charts.key(button.dataset.key);
document.addEventListener("looking", () => {
  known.looking = charts.looking;
  document.body.classList.toggle("looking", Boolean(known.looking));
  $("pause").firstChild.textContent = known.looking ? "Live " : "Pause ";
  line.show(known);
});
document.addEventListener("chosen", ({ detail }) => {
  known.chosen = detail;
  tell("chosen");
});
document.addEventListener("spectrum", ({ detail }) => {
  $("noise").hidden = !detail;
  document.body.classList.toggle("noisy", Boolean(detail));
  $("opennoise").setAttribute("aria-pressed", String(Boolean(detail)));
});
addEventListener("resize", () => charts.dress());
