// Puts the parts of the page together. The measurement never waits for the page.

import { Calibrating } from "./calibration.js";
import { FitPlot } from "./charts/fitplot.js";
import { Compare } from "./compare.js";
import { Connection } from "./connection.js";
import { Demo } from "./demo.js";
import { Depths } from "./depths.js";
import { Device } from "./device.js";
import { $, put } from "./dom.js";
import { Marks } from "./marks.js";
import { Instrument } from "./measure/instrument.js";
import { TouchedObject } from "./measure/object.js";
import { Pills } from "./measure/pills.js";
import { Scale } from "./measure/scale.js";
import { Strip } from "./measure/strip.js";
import { Signals } from "./preferences.js";
import { Record } from "./record.js";
import { Session } from "./session.js";
import { Shell } from "./shell.js";
import { SpecimenList } from "./specimen_list.js";
import { Start } from "./start.js";
import { Store } from "./store.js";
import { merged } from "./table.js";
import { TouchFinder } from "./touch_finder.js";
import { Verification } from "./verification.js";

const SILENT = ["view", "cut", "compare", "read list", "settings", "press", "release"]; // asked for by the charts, not by a person

const store = new Store();
const connection = new Connection({
  up: () => showConnection(null),
  down: (title, text) => showConnection({ title, text }),
  frame: (buffer) => {
    store.take(buffer);
    charts.frame();
    strip.later();
  },
  text: receive,
});
const shell = new Shell(store, {
  send,
  actions: { next, close, refuse, depth: (name) => depths.show(name) },
});
const { known, line, charts } = shell;
const answer = (text, bad) => line.answer(text, bad);
const found = new TouchFinder(shell, send, answer);
const compare = new Compare(send, answer);
const marks = new Marks(known, send);
const session = new Session(known, send);
const list = new SpecimenList(known, send);
const strip = new Strip(store);
const depths = new Depths(showDepth);
charts.fitplot = new FitPlot($("fitplot"), charts);
shell.parts.unshift(depths, found, compare);
shell.parts.push(
  new Instrument(),
  new Scale(),
  new TouchedObject(known, send),
  new Pills(send),
  strip,
  new Start(openSource),
  session,
  marks,
  new Device(send),
  new Calibrating(send),
  new Demo(known, send),
  new Verification(),
  new Record(known, send),
  new Signals(),
  { update: enable },
);

function receive(message) {
  const { type } = message;
  if (type === "done") showDone(message);
  else if (type === "refused") showRefused(message);
  else if (type === "touches") shell.receive(type, merged(known.touches.rows, message));
  else shell.receive(type, message);
}

function showDone(message) {
  if (message.do === "tare anyway") known.forced = false;
  if (!SILENT.includes(message.do)) answer(message.message);
  if (message.do === "mark") marks.open(message.id, "");
  if (message.do === "cut") charts.cursors.showAnswer(message.message);
  if (message.do === "compare") showComparison(message);
  if (message.do === "open") showOpened();
  if (message.do === "plan") list.answered(message.message, true);
  if (message.do === "read list" && message.lines) list.read(message.lines);
}

function showRefused(message) {
  if (!list.answered(message.message)) answer(message.message, true);
  known.forced = message.message.startsWith("tare:");
  enable("state");
}

function showComparison(message) {
  depths.show("lab");
  compare.show(message);
}

function openSource(what) {
  if (send({ do: "open", what })) answer(`Opening ${what} …`);
}

function showOpened() {
  if (compare.open) compare.turn(false);
  depths.show(depths.usual);
}

function showDepth() {
  $("menu").hidePopover();
  shell.update("depth");
  charts.show();
}

function send(message) {
  const sent = connection.send(message);
  if (!sent && !SILENT.includes(message.do)) answer("Not connected: the command was not sent.", true);
  return sent;
}

function next() {
  if (compare.open) compare.next();
  else if (known.found) found.step(1);
  else if (!$("again").hidden && !known.finished) $("again").click();
  else session.next();
}

// A key whose button cannot be pressed now.
function refuse({ firstChild }) {
  answer(`${firstChild.textContent.trim()}: not possible now${line.down ? ", without a connection" : ""}.`, true);
}

function showConnection(down) {
  if (!line.down || !down) known.offline = down && new Date().toLocaleTimeString();
  line.down = down;
  document.body.dataset.up = down ? "no" : "yes";
  shell.update("state");
}

// What can be done now.
function enable(type) {
  if (type !== "state" && type !== "hello") return;
  const { hello, state } = known;
  const { simulation } = hello;
  const up = !line.down;
  const ended = state.state === "ended";
  const file = hello.kind === "file";
  const idle = !up || file || ended;
  if (state.state === "no contact") known.forced = false;
  const anyway = known.forced || state.line?.what === "touched";
  const faulty = state.now?.tone === "fault" && state.now.word !== "Tare";
  const hidden = {
    tare: ended || file,
    again: !ended || file,
    mark: file,
    pause: file,
    record: file,
    discard: file,
    calibrate: file,
    simulated: !simulation,
    progress: !state.progress,
  };
  const disabled = {
    tare: idle || (!anyway && faulty),
    again: !up,
    mark: idle,
    record: idle && !(up && state.recording),
  };
  for (const [id, is] of Object.entries(hidden)) $(id).hidden = is;
  for (const [id, is] of Object.entries(disabled)) $(id).disabled = is;
  document.body.classList.toggle("file", file);
  document.body.classList.toggle("calibrated", Boolean(hello.calibrated));
  $("tare").dataset.do = anyway ? "tare anyway" : "tare";
  $("tare").firstChild.textContent = anyway ? "Tare anyway " : "Tare ";
  put($("progress").firstChild, state.progress ?? "");
  put("source", sourceWords());
  for (const button of document.querySelectorAll("[data-press]")) {
    const { hidden: isHidden, disabled: isDisabled } = $(button.dataset.press);
    button.hidden = isHidden;
    button.disabled = isDisabled;
  }
}

function sourceWords() {
  const { hello, state } = known;
  const device = (!hello.simulation && hello.device) || hello.source;
  const words = [hello.file?.name, device, hello.scene, ...(hello.stated ?? []), state.recording?.name];
  return words.filter(Boolean).join(" · ");
}

function close() {
  if (!$("marking").hidden) marks.close();
  else if (compare.open) compare.turn(false);
  else shell.close();
}

function toggleFullScreen() {
  if (document.fullscreenElement) document.exitFullscreen();
  else document.documentElement.requestFullscreen();
}

for (const button of document.querySelectorAll("[data-press]")) {
  button.onclick = () => $(button.dataset.press).click();
}
for (const button of document.querySelectorAll("[data-do]")) {
  button.onclick = () => send({ do: button.dataset.do });
}
$("leave").onclick = () => $("discard").click();
$("fullscreen").onclick = toggleFullScreen;
$("menu").onclick = () => $("menu").hidePopover();
