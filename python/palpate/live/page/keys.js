// The keyboard: every action has a key, and `?` shows them all.

import { $, ask, make } from "./dom.js";

const HELD = ["arrowleft", "arrowright", "+", "=", "-"]; // a key that is held down repeats these only

export class Keys {
  // acts: name of an action -> function, for those that are not a button; chart: gets the keys of the charts; more: keys of
  // this page alone. A key without an action, or whose button the page lacks, is none.
  constructor(acts, chart, more = []) {
    const press = (id) => $(id) && (() => $(id).hidden || $(id).click());
    const give = (name) => () => chart(name);
    this.keys = [
      ["T", "t", "Tare: measure the baseline", press("tare")], ["M", "m", "Mark this moment; its text may come later", press("mark")],
      ["R", "r", "Record, or end the recording", press("record")], ["D", "d", "Discard the last touch, or keep it", press("discard")],
      ["N", "n", "Next specimen", acts.next], ["P", "p", "Specimens of the session", press("openplan")],
      ["K", "k", "Calibrate, or end it", press("calibrate")], ["F", "f", "Files, and the name of the next recording", press("openfiles")],
      ["Space", " ", "Pause the charts, or back to now", acts.pause], ["L", "l", "Live: back to now", give("live")],
      ["← →", "arrowleft", "Move the window", give("left")], [null, "arrowright", null, give("right")],
      ["+ −", "+", "Zoom in and out", give("in")], [null, "=", null, give("in")], [null, "-", null, give("out")],
      ["0", "0", "The whole measurement", give("all")], ["A B", "a", "Cursors", give("cursor a")], [null, "b", null, give("cursor b")],
      ["S", "s", "Noise and its spectrum", press("opennoise")], ["?", "?", "These keys", press("help")],
      ["Esc", "escape", "Close what is open; no cursors", acts.close],
      ...more.map(([shown, words, id]) => [shown, shown.toLowerCase(), words, press(id)]),
    ].filter(([, , , act]) => act);
    $("help").onclick = () => ask($("keys"));
    $("keylist").append(...this.keys.filter(([shown]) => shown).flatMap(([shown, , words]) => [make("dt", {}, ...shown.split(" ").map((key) => make("kbd", { textContent: key }))), make("dd", { textContent: words })]));
    document.addEventListener("keydown", (event) => this.hear(event));
    document.addEventListener("click", letGo);
  }

  hear(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
    const typing = event.target.closest("input, select, textarea"), key = event.key.toLowerCase();
    if (typing && key !== "escape") return;
    if (key === " " && event.target.closest("button, a")) return;
    const found = this.keys.find(([, name]) => name === key);
    if (!found || (event.repeat && !HELD.includes(key))) return;
    event.preventDefault();
    found[3]();
  }
}

// A button that was pressed by a pointer gives the keys back: Space would press it again.
function letGo(event) {
  const button = event.target.closest("button");
  if (event.detail && button && document.activeElement === button) button.blur();
}
