// A tone and a flash at the end of a touch, for eyes that are on the specimen. Off or on, and remembered.

import { $, remember, remembered } from "./dom.js";

const TONES = { good: [880, 1320], caution: [440, 330], fault: [220, 220, 220] }; // Hz, one after another
const LENGTH_S = 0.12, LOUD = 0.15;

export class Signals {
  constructor() {
    this.on = remembered("signals") !== "off";
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
    remember("signals", this.on ? "on" : "off");
    this.wake();
    this.show();
    if (this.on) this.give("good");
  }

  show() {
    $("sound").setAttribute("aria-pressed", String(this.on));
    $("sound").title = this.on ? "Tone and flash at the end of a touch: on" : "Tone and flash at the end of a touch: off";
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
    this.count = (this.count ?? 0) + 1;
    document.body.dataset.signals = this.count;
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
