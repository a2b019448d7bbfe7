// What this browser remembers: the settings, and what was typed and is not sent yet.

import { $, ask, put } from "./dom.js";
import { settings } from "./formatting.js";

// In a frame, a browser may forbid storage: then it holds until the page is closed.
export function storage() {
  try {
    return localStorage;
  } catch {
    return {};
  }
}

// Keeps the settings of the dialog in a memory. changed(): shows the page again.
export function remember(changed, memory = storage()) {
  const form = $("settings").firstElementChild;
  const system = matchMedia("(prefers-color-scheme: dark)");
  const apply = () => {
    Object.assign(settings, Object.fromEntries(new FormData(form)));
    const dark = settings.theme === "system" ? system.matches : settings.theme === "dark";
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    document.body.classList.toggle("keyless", settings.keys === "off");
    for (const place of document.querySelectorAll(".unit")) put(place, settings.unit);
    changed();
  };
  for (const { name } of form.elements) if (name in memory) form.elements[name].value = memory[name];
  form.oninput = ({ target: { name, value } }) => {
    memory[name] = value;
    apply();
  };
  system.onchange = apply;
  $("opensettings").onclick = () => ask($("settings"));
  apply();
}

// A tone and a flash at the end of a touch, for eyes that are on the specimen.
const TONES = { good: [880, 1320], caution: [440, 330], fault: [220, 220, 220] }; // Hz, one after another
const LENGTH_S = 0.12;
const LOUD = 0.15;

export class Signals {
  constructor() {
    // A browser lets a page sound only after the user has touched it.
    for (const event of ["pointerdown", "keydown"]) {
      document.addEventListener(event, () => this.wake());
    }
    for (const input of document.querySelectorAll("[name=signals]")) {
      input.onchange = () => this.give("good");
    }
  }

  update(type, { state }) {
    const tone = state.now?.tone;
    if (type !== "state" || tone === this.tone) return;
    const first = this.tone === undefined;
    this.tone = tone;
    if (!first && TONES[tone]) this.give(tone);
  }

  wake() {
    if (settings.signals !== "on") return;
    this.audio ??= new AudioContext();
    this.audio.resume();
  }

  give(tone) {
    if (settings.signals !== "on") return;
    const calm = matchMedia("(prefers-reduced-motion: reduce)").matches; // at the edge: the word is read meanwhile
    const place = document.body.dataset.depth === "measure" ? $("instrument") : $("state");
    const flash = { outline: ["8px solid var(--ink)", "0 solid"], outlineOffset: "-8px", easing: "steps(2, jump-none)" };
    place.animate(flash, { duration: calm ? 700 : 280, iterations: calm ? 1 : 2 });
    if (this.audio?.state !== "running") return;
    TONES[tone].forEach((hz, i) => this.sound(hz, this.audio.currentTime + i * LENGTH_S * 1.2));
  }

  sound(hz, from) {
    const tone = this.audio.createOscillator();
    const volume = this.audio.createGain();
    tone.frequency.value = hz;
    volume.gain.setValueAtTime(LOUD, from);
    volume.gain.exponentialRampToValueAtTime(0.001, from + LENGTH_S);
    tone.connect(volume).connect(this.audio.destination);
    tone.start(from);
    tone.stop(from + LENGTH_S);
  }
}
