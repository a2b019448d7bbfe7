// Display and buttons of the page. The measurement never waits for the page.

import { Charts } from "./charts.js";
import { Connection } from "./connection.js";
import { Store } from "./store.js";
import { bySource, counted, modulusOf, plusMinus, touchRow } from "./formatting.js";

const $ = (id) => document.getElementById(id);
const store = new Store();
const charts = new Charts({ changes: $("changes"), ratios: $("ratios"), statistics: $("statistics") });
const CONFIRMED = 4; // every fourth frame; the server sends 30 more at most
let hello = {}, state = {}, changed = false, past = [];

const connection = new Connection({
  up: () => setLink(true, "connected"),
  down: (what, advice) => setLink(false, what, advice),
  frame: (buffer) => {
    const frame = store.take(buffer);
    if (frame % CONFIRMED === 0) connection.say({ do: "seen", frame });
    redraw();
  },
  text: (message) => tell[message.type]?.(message),
});

const tell = {
  hello: (message) => {
    if (hello.measurement !== message.measurement) store.clear();
    hello = message;
    $("instrument").textContent = bySource(hello);
    $("unit").textContent = hello.statistic_unit ? `, ${hello.statistic_unit}` : "";
    $("modulus-tile").hidden = !hello.calibrated;
    $("touches").classList.toggle("calibrated", hello.calibrated);
    charts.threshold = hello.threshold;
    past = [];
    redraw();
  },
  state: (message) => {
    state = message;
    showState();
    showCounters();
    showRecording();
  },
  touches: ({ rows, most_reliable, together }) => {
    past = rows;
    $("rows").replaceChildren(...rows.toReversed().map((touch) => touchRow(touch, touch.number === most_reliable)));
    $("none").hidden = rows.length > 0;
    $("together").textContent = together ? together.text + (together.modulus ? `, if all are on one object: ${together.modulus.text}` : "") : "";
    $("together").dataset.agree = together?.agree === false ? "no" : "yes";
    showState();
  },
  marks: ({ rows }) => {
    charts.marks = rows.map(({ t_s, text }) => ({ at: t_s - (store.origin ?? t_s), text }));
    redraw();
  },
  done: ({ message }) => say(message),
  refused: ({ message }) => {
    say(message, true);
    $("anyway").hidden = !message.startsWith("tare:") || !PRESSED.includes(state.state);
  },
  failed: ({ message }) => say(message, true),
};

const PRESSED = ["contact", "adapting", "done"];
const ADVICE = {
  "baseline": "measuring the baseline: do not touch anything",
  "no contact": "press the probe on an object",
  "contact": "measuring",
  "adapting": "the ratio changes, or is not known yet",
  "done": "touch complete: lift the probe",
};

function showState() {
  const name = state.state ?? "–", now = state.ratio !== null && state.ratio !== undefined;
  const last = past.at(-1);
  $("state").textContent = name;
  $("state").dataset.state = name;
  $("advice").textContent = name === "ended" ? state.error || "the source has ended" : ADVICE[name] ?? "";
  const { ratio = null, standard_error: error = null, uncertainty = null } = (now ? state : last) ?? {};
  const [value, reach] = plusMinus(ratio, uncertainty);
  $("ratio").textContent = value;
  $("ratio").parentElement.classList.toggle("past", !now);
  $("error").textContent = [ratio === null ? "no touch yet" : error === null ? "standard error not known yet" : `${reach} ${hello.scatter ? `with ${hello.scatter}` : "standard error"}`,
                            !now && last ? `touch ${last.number}${last.revised ? ", revised" : ""}` : ""].filter(Boolean).join(", ");
  $("warning").textContent = now ? "" : (last?.advice ?? []).join(". ");
  const modulus = now ? state.modulus : last?.modulus;
  [$("modulus").textContent, $("interval").textContent] = modulusOf(modulus);
}

function showCounters() {
  $("rate").textContent = state.pairs_per_s === null || state.state === "ended" ? "–" : state.pairs_per_s.toFixed(1);
  $("counters").textContent = counted(state.counters);
  $("frames").textContent = `This page: ${state.frames.sent} frames, ${state.frames.lost} samples missed because it slept too long.`;
  $("told").textContent = state.messages.at(-1) ?? "";
}

function showRecording() {
  const running = state.state !== "ended", { recording } = state;
  $("record").firstChild.textContent = recording ? "Stop recording " : "Record ";
  $("record").setAttribute("aria-pressed", String(Boolean(recording)));
  $("record").disabled = !running || !hello.may_record;
  $("record").title = hello.may_record ? (recording ? `${recording.name}: ${recording.rows} rows` : "") : "Start palpate live with --record NAME.csv to allow it";
  $("mark").disabled = !running || !recording;
  $("mark").title = recording ? "" : "Marks are stored in a recording: press Record first";
  $("tare").disabled = !running;
  $("anyway").hidden ||= !running || !PRESSED.includes(state.state);
  $("again").hidden = running;
  const names = state.recordings.join(" ");
  if ($("downloads").dataset.names !== names) {
    $("downloads").dataset.names = names;
    $("downloads").replaceChildren(...state.recordings.slice(-3).flatMap((name) => [name, name.replace(/\.csv$/i, ".json")]).map(download));
  }
}

function download(name) {
  const anchor = document.createElement("a");
  anchor.href = `recording/${encodeURIComponent(name)}`;
  anchor.download = name;
  anchor.textContent = `↓ ${name}`;
  anchor.title = name.endsWith(".json") ? "Download the settings, device and notes" : "Download the samples";
  return anchor;
}

const SAID_MS = 15000;
let saying = 0;

function say(text, bad = false) {
  $("message").textContent = text;
  $("message").dataset.bad = bad ? "yes" : "no";
  clearTimeout(saying);
  saying = setTimeout(() => ($("message").textContent = ""), SAID_MS);
}

function setLink(up, text, advice) {
  $("link").textContent = text;
  $("link").dataset.up = document.body.dataset.up = up ? "yes" : "no";
  if (!up) $("advice").textContent = advice;
  for (const id of ["tare", "anyway", "mark", "record", "again"]) $(id).disabled = !up;
}

function command(message) {
  if (!connection.say(message)) say("Not connected: the command was not sent.", true);
}

const DO = {
  tare: () => command({ do: "tare" }),
  anyway: () => command({ do: "tare anyway" }),
  record: () => command({ do: state.recording ? "stop" : "record" }),
  again: () => command({ do: "again" }),
  mark: () => {
    $("text").value = "";
    $("marking").returnValue = "";
    $("marking").showModal();
  },
};
for (const [id, act] of Object.entries(DO)) $(id).addEventListener("click", act);
$("cancel").addEventListener("click", () => $("marking").close());
$("marking").addEventListener("close", () => {
  const text = $("text").value.trim();
  if ($("marking").returnValue === "mark" && text) command({ do: "mark", text });
});
document.addEventListener("keydown", (event) => {
  const id = { t: "tare", m: "mark", r: "record" }[event.key.toLowerCase()];
  const elsewhere = event.ctrlKey || event.metaKey || event.altKey || $("marking").open || event.target.closest("input, select");
  if (!id || elsewhere || $(id).disabled) return;
  event.preventDefault();
  DO[id]();
});

const THEMES = ["system", "light", "dark"], system = matchMedia("(prefers-color-scheme: dark)");
let theme = THEMES.indexOf(remembered() ?? "system");
function dress() {
  const name = THEMES[theme < 0 ? 0 : theme];
  document.documentElement.dataset.theme = name === "system" ? (system.matches ? "dark" : "light") : name;
  $("theme").textContent = `Theme: ${name}`;
  charts.build();
  redraw();
}
// In a frame, a browser may forbid storage.
function remembered() {
  try {
    return localStorage.getItem("theme");
  } catch {
    return null;
  }
}
function remember(name) {
  try {
    localStorage.setItem("theme", name);
  } catch {
    // it holds until the page is closed
  }
}
$("theme").addEventListener("click", () => {
  theme = (Math.max(theme, 0) + 1) % THEMES.length;
  remember(THEMES[theme]);
  dress();
});
system.addEventListener("change", dress);
$("seconds").addEventListener("change", redraw);

// Draws in the next animation frame, once.
function redraw() {
  if (!changed) requestAnimationFrame(paint);
  changed = true;
}
function paint() {
  changed = false;
  charts.draw(store, Number($("seconds").value));
}
dress();
