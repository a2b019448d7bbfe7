// The dialog for the list of specimens: typed, pasted, or from a file.

import { $, ask } from "./dom.js";

const LONGEST = 4000; // characters

export class Plan {
  constructor(say, answer) {
    this.say = say;
    $("openplan").onclick = () => this.open();
    $("listfile").onchange = () => this.load(answer);
    $("list").oninput = () => this.judge();
  }

  tell(type, known) {
    this.session = known.session;
  }

  open() {
    const { title, operator, wanted, specimens } = this.session;
    $("title").value = title ?? "";
    $("operator").value = operator ?? "";
    $("wanted").value = wanted || 4;
    $("list").value = specimens.map(({ name, modulus }) => (modulus ? `${name}; ${modulus}` : name)).join("\n");
    $("listfile").value = "";
    this.judge();
    ask($("plan"), () => this.send());
  }

  async load(answer) {
    const [file] = $("listfile").files;
    if (!file) return;
    if (file.size > LONGEST) answer(`${file.name}: ${file.size} bytes, allowed: ${LONGEST}; one specimen a line`, true);
    else $("list").value = await file.text();
    this.judge();
  }

  // A list that is too long is not cut without a word: the browser says what is wrong, and keeps the dialog open.
  judge() {
    const { length } = $("list").value;
    $("list").setCustomValidity(length > LONGEST ? `${length} characters, allowed: ${LONGEST}. Shorten the names, or use two sessions.` : "");
  }

  send() {
    this.say({ do: "plan", text: $("list").value, wanted: Math.max(1, Math.min(99, Math.round($("wanted").valueAsNumber) || 4)), title: $("title").value, operator: $("operator").value });
  }
}
