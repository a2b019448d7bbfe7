// Colours: as the system has them, light, or dark.

import { $, remember, remembered } from "./dom.js";

const THEMES = ["system", "light", "dark"];

export class Theme {
  // memory: where the choice is kept, if it is
  constructor(dressed, memory = { remember, remembered }) {
    Object.assign(this, { dressed, memory });
    this.system = matchMedia("(prefers-color-scheme: dark)");
    const name = memory.remembered("theme");
    this.name = THEMES.includes(name) ? name : "system";
    $("theme").onclick = () => this.next();
    this.system.onchange = () => this.dress();
    this.dress();
  }

  next() {
    this.name = THEMES[(THEMES.indexOf(this.name) + 1) % THEMES.length];
    this.memory.remember("theme", this.name);
    this.dress();
  }

  dress() {
    const dark = this.name === "system" ? this.system.matches : this.name === "dark";
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    $("theme").title = `Colours: ${this.name}`;
    $("theme").setAttribute("aria-label", `Colours: ${this.name}`);
    this.dressed();
  }
}
