// Puts the parts of the page together. The measurement never waits for the page.

import { Calibrating } from "./calibration.js";
import { FitPlot } from "./charts/fitplot.js";
import { Spectrum } from "./charts/spectrum.js";
import { Connection } from "./connection.js";
import { Compare } from "./compare.js";
import { Device } from "./device.js";
import { $, put } from "./dom.js";
import { Found } from "./found.js";
import { Marks } from "./marks.js";
import { Signals } from "./preferences.js";
import { Record } from "./record.js";
import { Screen } from "./screen.js";
import { Plan, Session } from "./session.js";
import { Store } from "./store.js";
import { merged } from "./table.js";

const KEPT = ["hello", "state", "touches", "events", "session", "calibration", "device"];
const SILENT = ["view", "noise", "cut", "compare", "read list", "settings"]; // asked for by the charts, not by a person

const store = new Store();
const connection = new Connection({
  up: () => link(null),
  down: (what, advice) => link({ title: sentence(what), text: sentence(advice) }),
  frame: (buffer) => {
    store.take(buffer);
    screen.charts.frame();
  },
  text: hear,
});
const marks = new Marks(say), session = new Session(say), plan = new Plan(say);
const screen = new Screen(store, {
  say: (message) => connection.say(message),
  change: say,
  others: { fitplot: FitPlot, spectrum: Spectrum },
  acts: { next: () => (compare.open ? compare : known.found ? { next: () => found.step(1) } : session).next(), before: () => known.found && found.step(-1), find: () => focus("find"), go: () => focus("time"), close, refuse },
});
const { known, line } = screen, answer = (text, bad) => line.answer(text, bad), found = new Found(screen, say, answer), compare = new Compare(say, answer);
screen.parts.unshift(found, compare);
screen.parts.push(session, plan, marks, new Device(say), new Calibrating(say), new Record(say), new Signals(), { tell: enable });

const ANSWERS = {
  done: (message) => {
    known.forced &&= message.do !== "tare anyway";
    if (!SILENT.includes(message.do)) answer(message.message);
    if (message.do === "mark") marks.made(message);
    if (message.do === "cut") screen.charts.cursors.tell(message.message);
    if (message.do === "compare") compare.show(message);
    if (message.do === "plan") plan.answered(message.message, true);
    if (message.do === "read list" && message.lines) plan.read(message.lines);
  },
  refused: (message) => {
    if (!plan.answered(message.message)) answer(message.message, true);
    known.forced = message.message.startsWith("tare:");
    enable("state");
  },
  failed: (message) => answer(message.message, true),
};

function hear(message) {
  const { type } = message;
  ANSWERS[type]?.(message);
  if (KEPT.includes(type)) screen.hear(type, type === "touches" ? merged(known.touches.rows, message) : message);
  else screen.charts.tell(type, message);
}

function say(message) {
  const sent = connection.say(message);
  if (!sent) answer("Not connected: the command was not sent.", true);
  return sent;
}

// A key whose button cannot be pressed now.
function refuse({ firstChild }) {
  answer(`${firstChild.textContent.trim()}: not possible now${line.down ? ", without a connection" : ""}.`, true);
}

function sentence(text) {
  return `${text.charAt(0).toUpperCase()}${text.slice(1)}.`;
}

function link(down) {
  if (!line.down || !down) known.offline = down && new Date().toLocaleTimeString();
  line.down = down;
  document.body.dataset.up = down ? "no" : "yes";
  screen.tell("state");
}

// What can be done now.
function enable(type) {
  if (type !== "state" && type !== "hello") return;
  const up = !line.down, file = known.hello.kind === "file", ended = known.state.state === "ended";
  const measuring = up && !file && !ended;
  document.body.classList.toggle("file", file);
  document.body.classList.toggle("calibrated", Boolean(known.hello.calibrated));
  $("tare").hidden = ended || file;
  for (const id of ["mark", "pause", "record"]) $(id).hidden = file;
  $("progress").hidden = !known.state.progress;
  put($("progress").firstChild, known.state.progress ?? "");
  $("again").hidden = !ended || file;
  $("again").disabled = !up;
  known.forced &&= known.state.state !== "no contact";
  const anyway = known.forced || ["endless", "touched"].includes(known.state.line?.what), { tone, word } = known.state.now ?? {};
  $("tare").firstChild.textContent = anyway ? "Tare anyway " : "Tare ";
  $("tare").disabled = !measuring || (!anyway && tone === "fault" && word !== "Tare");
  $("mark").disabled = $("record").disabled = !measuring;
  if (known.state.recording && up) $("record").disabled = false;
  const { hello, state } = known, { simulation } = hello, demo = Boolean(simulation?.demo);
  $("simulated").hidden = !simulation;
  document.body.classList.toggle("demo", demo);
  for (const id of ["calibrate", "discard"]) $(id).hidden = file || demo;
  $("openplan").hidden = demo;
  const what = demo ? ["no board is connected"] : [hello.file?.name, (!simulation && hello.device) || hello.source, hello.scene];
  put("source", [...what, state.recording?.name].filter(Boolean).join(" · "));
}

function close() {
  if (!$("marking").hidden) return marks.close();
  if (compare.open) return compare.turn(false);
  menu(false);
  screen.close();
}

function focus(id) {
  if (known.found) $(id).select();
}

function menu(open) {
  document.body.classList.toggle("menu", open);
  $("more").ariaExpanded = String(open);
}

for (const button of document.querySelectorAll("[data-press]")) button.onclick = () => $(button.dataset.press).click();
$("tare").onclick = () => say({ do: $("tare").textContent.startsWith("Tare anyway") ? "tare anyway" : "tare" });
$("stopreport").onclick = () => say({ do: "stop report" });
$("again").onclick = () => say({ do: "again" });
$("understood").onclick = () => say({ do: "understood" });
$("more").onclick = () => menu(!document.body.classList.contains("menu"));
$("menu").onclick = () => menu(false);
$("closenoise").onclick = () => screen.charts.key("spectrum");
