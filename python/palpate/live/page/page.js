// Puts the parts of the page together. The measurement never waits for the page.

import { Calibrating } from "./calibration.js";
import { FitPlot } from "./charts/fitplot.js";
import { Connection } from "./connection.js";
import { Compare } from "./compare.js";
import { Device } from "./device.js";
import { $, put } from "./dom.js";
import { TouchFinder } from "./touch_finder.js";
import { Marks } from "./marks.js";
import { Signals } from "./preferences.js";
import { Record } from "./record.js";
import { Screen } from "./screen.js";
import { Plan, Session } from "./session.js";
import { Store } from "./store.js";
import { merged } from "./table.js";
import { Verification } from "./verification.js";

const SILENT = ["view", "cut", "compare", "read list", "settings"]; // asked for by the charts, not by a person

const store = new Store();
const connection = new Connection({
  up: () => link(null),
  down: (title, text) => link({ title, text }),
  frame: (buffer) => {
    store.take(buffer);
    charts.frame();
  },
  text: hear,
});
const screen = new Screen(store, {
  say,
  acts: { next: () => (compare.open ? compare.next() : known.found ? found.step(1) : session.next()), close, refuse },
});
const { known, line, charts } = screen, answer = (text, bad) => line.answer(text, bad), found = new TouchFinder(screen, say, answer), compare = new Compare(say, answer);
const marks = new Marks(known, say), session = new Session(known, say), plan = new Plan(known, say);
charts.fitplot = new FitPlot($("fitplot"), charts);
screen.parts.unshift(found, compare);
screen.parts.push(session, marks, new Device(say), new Calibrating(say), new Verification(), new Record(known, say), new Signals(), { tell: enable });

const ANSWERS = {
  done: (message) => {
    known.forced &&= message.do !== "tare anyway";
    if (!SILENT.includes(message.do)) answer(message.message);
    if (message.do === "mark") marks.open(message.id, "");
    if (message.do === "cut") charts.cursors.showAnswer(message.message);
    if (message.do === "compare") compare.show(message);
    if (message.do === "plan") plan.answered(message.message, true);
    if (message.do === "read list" && message.lines) plan.read(message.lines);
  },
  refused: (message) => {
    if (!plan.answered(message.message)) answer(message.message, true);
    known.forced = message.message.startsWith("tare:");
    enable("state");
  },
};

function hear(message) {
  const { type } = message;
  if (ANSWERS[type]) ANSWERS[type](message);
  else screen.hear(type, type === "touches" ? merged(known.touches.rows, message) : message);
}

function say(message) {
  const sent = connection.say(message);
  if (!sent && !SILENT.includes(message.do)) answer("Not connected: the command was not sent.", true);
  return sent;
}

// A key whose button cannot be pressed now.
function refuse({ firstChild }) {
  answer(`${firstChild.textContent.trim()}: not possible now${line.down ? ", without a connection" : ""}.`, true);
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
  const { hello, state } = known, { simulation } = hello, up = !line.down, ended = state.state === "ended", { tone, word } = state.now ?? {};
  const file = hello.kind === "file", demo = Boolean(simulation?.demo), idle = !up || file || ended;
  known.forced &&= state.state !== "no contact";
  const anyway = known.forced || state.line?.what === "touched";
  const hidden = { tare: ended || file, again: !ended || file, mark: file, pause: file, record: file, discard: file || demo, calibrate: file || demo, openplan: demo, simulated: !simulation, progress: !state.progress };
  const disabled = { tare: idle || (!anyway && tone === "fault" && word !== "Tare"), again: !up, mark: idle, record: idle && !(up && state.recording) };
  for (const [name, on] of Object.entries({ file, demo, calibrated: Boolean(hello.calibrated) })) document.body.classList.toggle(name, on);
  for (const [id, is] of Object.entries(hidden)) $(id).hidden = is;
  for (const [id, is] of Object.entries(disabled)) $(id).disabled = is;
  $("tare").dataset.do = anyway ? "tare anyway" : "tare";
  $("tare").firstChild.textContent = anyway ? "Tare anyway " : "Tare ";
  put($("progress").firstChild, state.progress ?? "");
  const what = demo ? ["no board is connected"] : [hello.file?.name, (!simulation && hello.device) || hello.source, hello.scene, ...(hello.stated ?? [])];
  put("source", [...what, state.recording?.name].filter(Boolean).join(" · "));
}

function close() {
  if (!$("marking").hidden) return marks.close();
  if (compare.open) return compare.turn(false);
  screen.close();
}

for (const button of document.querySelectorAll("[data-press]")) button.onclick = () => $(button.dataset.press).click();
for (const button of document.querySelectorAll("[data-do]")) button.onclick = () => say({ do: button.dataset.do });
$("menu").onclick = () => $("menu").hidePopover();
