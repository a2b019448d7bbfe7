// The keyboard: every action has a key, and `?` shows them all.

import { $, ask, make } from "./dom.js";
import { settings } from "./formatting.js";

const HELD = ["arrowleft", "arrowright", "+", "=", "-"]; // a key that is held down repeats these only
const PEDALS = ["enter", "pagedown"]; // of a foot switch; they mean "next" in Measure only
const FIELDS = "input, select, textarea";

// actions: name -> function, for those that are not a button; chart(name): a key of the charts; more: keys of this page alone.
export function listen(actions, chart, more) {
  const keys = keysOf(actions, chart, more).filter(({ act }) => act);
  $("help").onclick = () => ask($("keys"));
  for (const { shown, words } of keys) {
    if (!shown) continue;
    const names = shown.split(" ").map((key) => make("kbd", { textContent: key }));
    $("keylist").append(make("dt", {}, ...names), make("dd", { textContent: words }));
  }
  document.addEventListener("click", letGo);
  document.addEventListener("keydown", (event) => {
    const key = meantKey(event);
    const found = keys.find(({ name }) => name === key);
    if (!found || (event.repeat && !HELD.includes(key))) return;
    event.preventDefault();
    found.act();
  });
}

// The name of the key that is meant as a command; null: it is typed, or means something else where it is pressed.
// Keys without Ctrl or Alt can be switched off, for speech input and for hands that hit them (WCAG 2.1.4).
function meantKey(event) {
  if (event.ctrlKey || event.metaKey || event.altKey) return null;
  if (document.querySelector("dialog[open]")) return null;
  const shift = event.shiftKey && /^[a-z]$/i.test(event.key);
  const key = `${shift ? "shift " : ""}${event.key.toLowerCase()}`;
  const typing = event.target.closest(FIELDS);
  if ((typing || settings.keys === "off") && key !== "escape") return null;
  if ([" ", "enter"].includes(key) && event.target.closest("button, a, summary")) return null;
  if (PEDALS.includes(key) && document.body.dataset.depth !== "measure") return null;
  return key;
}

// An action whose button the page lacks is none.
function keysOf(actions, chart, more) {
  const act = (element) => {
    if (element.disabled) actions.refuse?.(element);
    else if (element.matches("input")) element.select();
    else element.click();
  };
  const press = (id) => $(id) && (() => $(id).closest("[hidden]:not(main)") || act($(id)));
  const give = (name) => () => chart(name);
  const depth = (name) => actions.depth && (() => actions.depth(name));
  const keys = [
    ["1", "1", "Measure: the instrument", depth("measure")],
    ["2", "2", "Explain: one touch as a story", depth("explain")],
    ["3", "3", "Lab: charts, table, device", depth("lab")],
    ["T", "t", "Tare: measure the baseline", press("tare")],
    ["M", "m", "Mark this moment; its text may come later", press("mark")],
    ["R", "r", "Record, or end the recording", press("record")],
    ["D", "d", "Leave the shown touch out, or take it back", press("discard")],
    ["N", "n", "Next specimen; in a file the next touch found", actions.next],
    ["Enter PageDown", "enter", "Next, as a foot switch says it; in Measure", actions.next],
    [null, "pagedown", null, actions.next],
    ["Shift N", "shift n", "The touch before, in a file", press("before")],
    ["/", "/", "Find touches in a file", press("find")],
    ["G", "g", "Go to a time of a file", press("time")],
    ["C", "c", "Recordings beside each other", press("opencompare")],
    ["P", "p", "Specimens to touch", press("openplan")],
    ["K", "k", "Calibrate, or end it", press("calibrate")],
    ["F", "f", "Files, and the name of the next recording", press("openfiles")],
    ["Shift F", "shift f", "Full screen, or back", press("fullscreen")],
    ["Space", " ", "Pause the charts, or back to now", press("pause")],
    ["L", "l", "Live: back to now", give("live")],
    ["← →", "arrowleft", "Move the window; in Explain the touch before or after", give("left")],
    [null, "arrowright", null, give("right")],
    ["+ −", "+", "Zoom in and out", give("in")],
    [null, "=", null, give("in")],
    [null, "-", null, give("out")],
    ["0", "0", "The whole measurement", give("all")],
    ["A B", "a", "Cursors", give("cursor a")],
    [null, "b", null, give("cursor b")],
    ["S", "s", "Noise of each channel", press("noise")],
    [",", ",", "Settings: units, these keys, tone, colours, report", press("opensettings")],
    ["?", "?", "These keys", press("help")],
    ["Esc", "escape", "Close what is open; no cursors", actions.close],
    ...more.map(([shown, words, id]) => [shown, shown.toLowerCase(), words, press(id)]),
  ];
  return keys.map(([shown, name, words, run]) => ({ shown, name, words, act: run }));
}

// A button that was pressed by a pointer gives the keys back: Space would press it again.
function letGo(event) {
  const button = event.target.closest("button");
  if (event.detail && button && document.activeElement === button) button.blur();
}
