// What this browser remembers: the colours, and whether the end of a touch gives a tone and a flash.

import { $ } from "./dom.js";

// In a frame, a browser may forbid storage: then it holds until the page is closed.
export function storage() {
  try {
    return localStorage;
  } catch {
    return {};
  }
}

// Colours: as the system has them, light, or dark.
const THEMES = ["system", "light", "dark"];

export class Theme {
  // memory: where the choice is kept, if it is
  constructor(dressed, memory = storage()) {
    Object.assign(this, { dressed, memory });
    this.system = matchMedia("(prefers-color-scheme: dark)");
    this.name = THEMES.includes(memory.theme) ? memory.theme : "system";
    $("theme").onclick = () => this.next();
    this.system.onchange = () => this.dress();
    this.dress();
  }

  next() {
    this.name = this.memory.theme = THEMES[(THEMES.indexOf(this.name) + 1) % THEMES.length];
    this.dress();
  }

  dress() {
    const dark = this.name === "system" ? this.system.matches : this.name === "dark";
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    $("theme").title = $("theme").ariaLabel = `Colours: ${this.name}`;
    this.dressed();
  }
}

// A tone and a flash at the end of a touch, for eyes that are on the specimen. Off or on.
const TONES = { good: [880, 1320], caution: [440, 330], fault: [220, 220, 220] }; // Hz, one after another
const LENGTH_S = 0.12, LOUD = 0.15;

export class Signals {
  constructor() {
    this.memory = storage();
    this.on = this.memory.signals !== "off";
    $("sound").onclick = () => this.switch();
    for (const event of ["pointerdown", "keydown"]) document.addEventListener(event, () => this.wake());
    this.show();
  }

  // A browser lets a page sound only after the user has touched it.
  wake() {
    if (!this.on) return;
    this.audio ??= new AudioContext();
    if (this.audio.state === "suspended") this.audio.resume();
  }

  switch() {
    this.on = !this.on;
    this.memory.signals = this.on ? "on" : "off";
    this.wake();
    this.show();
    if (this.on) this.give("good");
  }

  show() {
    $("sound").ariaPressed = String(this.on);
    $("sound").title = `Tone and flash at the end of a touch: ${this.on ? "on" : "off"}`;
  }

  tell(type, { state }) {
    const tone = state.now?.tone;
    if (type !== "state" || tone === this.tone) return;
    const first = this.tone === undefined;
    this.tone = tone;
    if (this.on && !first && TONES[tone]) this.give(tone);
  }

  give(tone) {
    this.flash();
    document.body.dataset.signals = Number(document.body.dataset.signals ?? 0) + 1;
    if (this.audio?.state !== "running") return;
    TONES[tone].forEach((hz, i) => this.sound(hz, this.audio.currentTime + i * LENGTH_S * 1.2));
  }

  flash() {
    $("state").classList.remove("flash");
    void $("state").offsetWidth; // begins the animation again
    $("state").classList.add("flash");
  }

  sound(hz, from) {
    const tone = this.audio.createOscillator(), volume = this.audio.createGain();
    tone.frequency.value = hz;
    volume.gain.setValueAtTime(LOUD, from);
    volume.gain.exponentialRampToValueAtTime(0.001, from + LENGTH_S);
    tone.connect(volume).connect(this.audio.destination);
    tone.start(from);
    tone.stop(from + LENGTH_S);
  }
}
