// What the live page and docs/try have in common: state, line, table and charts, of one `known`, with their keys.

import { Charts } from "./charts/charts.js";
import { $, ask, make } from "./dom.js";
import { settings } from "./formatting.js";
import { Line } from "./line.js";
import { Now } from "./now.js";
import { remember } from "./preferences.js";
import { Table } from "./table.js";

const NOTHING = {
  touches: { rows: [] }, events: { marks: [], tares: [], gaps: [], judgements: [], flags: [] }, session: { specimens: [], notes: [] }, calibration: {}, device: {}, chosen: null, looking: null,
};

export class Screen {
  // store: Store; say(message): to the server, if there is one; acts, more: of Keys; memory: of Settings
  constructor(store, { say, acts, more = [], memory }) {
    this.known = { hello: {}, state: {}, ...NOTHING };
    this.store = store;
    this.line = new Line();
    this.charts = new Charts(store, this.known, say, (kind) => this.tell(kind));
    this.parts = [this.line, new Now(), new Table(this.known, say, (touch) => this.charts.choose(touch))];
    const key = (name) => this.charts.key(name);
    remember(() => this.dress(), memory);
    listen({ close: () => this.close(), ...acts }, key, more);
    $("pause").onclick = () => key(this.known.looking ? "live" : "pause");
    for (const button of document.querySelectorAll("[data-key]")) button.onclick = () => key(button.dataset.key);
    addEventListener("resize", () => this.charts.show());
    globalThis.palpate = this; // for the console: the numbers that are shown
  }

  // Takes a message of this kind: all parts show it. A hello of another measurement ends all that was known of the one before.
  hear(kind, message) {
    if (kind === "hello" && isOther(message, this.known.hello)) {
      Object.assign(this.known, NOTHING, { state: { ...this.known.state, end_s: null } });
      this.store.used = 0;
      this.charts.clear(message.kind === "file");
    }
    this.known[kind] = message;
    this.tell(kind);
    this.charts.show(kind);
  }

  // Shows all again, after a change of the settings.
  dress() {
    for (const kind of ["hello", "touches", "session", "calibration"]) if (this.known.hello.kind) this.hear(kind, { ...this.known[kind] });
    this.charts.show();
  }

  tell(kind) {
    for (const part of this.parts) part.tell(kind, this.known);
  }

  close() {
    document.activeElement?.blur();
    this.charts.choose(null);
    this.charts.key("clear");
  }
}

function isOther(hello, before) {
  return hello.measurement !== before.measurement || hello.kind !== before.kind || (before.origin_s !== null && hello.origin_s !== before.origin_s);
}

// The keyboard: every action has a key, and `?` shows them all.
const HELD = ["arrowleft", "arrowright", "+", "=", "-"]; // a key that is held down repeats these only

// acts: name of an action -> function, for those that are not a button; chart: gets the keys of the charts; more: keys of
// this page alone. A key without an action, or whose button the page lacks, is none.
function listen(acts, chart, more) {
  const go = (element) => (element.disabled ? acts.refuse?.(element) : element.matches("input") ? element.select() : element.click());
  const press = (id) => $(id) && (() => $(id).closest("[hidden]") || go($(id)));
  const give = (name) => () => chart(name);
  const keys = [
    ["T", "t", "Tare: measure the baseline", press("tare")], ["M", "m", "Mark this moment; its text may come later", press("mark")],
    ["R", "r", "Record, or end the recording", press("record")], ["D", "d", "Discard the last touch, or keep it", press("discard")],
    ["N", "n", "Next specimen; in a file the next touch found", acts.next], ["Shift N", "shift n", "The touch before, in a file", press("before")],
    ["/", "/", "Find touches in a file", press("find")], ["G", "g", "Go to a time of a file", press("time")], ["C", "c", "Recordings beside each other", press("opencompare")], ["P", "p", "Specimens of the session", press("openplan")],
    ["K", "k", "Calibrate, or end it", press("calibrate")], ["F", "f", "Files, and the name of the next recording", press("openfiles")],
    ["Space", " ", "Pause the charts, or back to now", press("pause")], ["L", "l", "Live: back to now", give("live")],
    ["← →", "arrowleft", "Move the window", give("left")], [null, "arrowright", null, give("right")],
    ["+ −", "+", "Zoom in and out", give("in")], [null, "=", null, give("in")], [null, "-", null, give("out")],
    ["0", "0", "The whole measurement", give("all")], ["A B", "a", "Cursors", give("cursor a")], [null, "b", null, give("cursor b")],
    ["S", "s", "Noise of each channel", press("noise")], [",", ",", "Settings: units, these keys, tone, colours, report", press("opensettings")],
    ["?", "?", "These keys", press("help")],
    ["Esc", "escape", "Close what is open; no cursors", acts.close],
    ...more.map(([shown, words, id]) => [shown, shown.toLowerCase(), words, press(id)]),
  ].filter(([, , , act]) => act);
  $("help").onclick = () => ask($("keys"));
  $("keylist").append(...keys.filter(([shown]) => shown).flatMap(([shown, , words]) => [make("dt", {}, ...shown.split(" ").map((key) => make("kbd", { textContent: key }))), make("dd", { textContent: words })]));
  document.addEventListener("click", letGo);
  // Keys without Ctrl or Alt can be switched off, for speech input and for hands that hit them (WCAG 2.1.4).
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
    const typing = event.target.closest("input, select, textarea"), key = `${event.shiftKey && /^[a-z]$/i.test(event.key) ? "shift " : ""}${event.key.toLowerCase()}`;
    if ((typing || settings.keys === "off") && key !== "escape") return;
    if (key === " " && event.target.closest("button, a")) return;
    const found = keys.find(([, name]) => name === key);
    if (!found || (event.repeat && !HELD.includes(key))) return;
    event.preventDefault();
    found[3]();
  });
}

// A button that was pressed by a pointer gives the keys back: Space would press it again.
function letGo(event) {
  const button = event.target.closest("button");
  if (event.detail && button && document.activeElement === button) button.blur();
}
