// The device: its facts, and what can be set on it.

import { $, ask, make, put } from "./dom.js";

export class Device {
  constructor(say) {
    this.say = say;
    $("openset").onclick = () => this.open();
    $("centre").onclick = () => say({ do: "centre" });
  }

  // One line while all is well; it opens at a warning.
  tell(type, { device, hello }) {
    if (type !== "device" && type !== "hello") return;
    this.options = Object.entries(device.options ?? {});
    const facts = device.facts ?? [];
    const wrong = facts.some(({ warn }) => warn), pace = facts.find(({ name }) => name === "Pairs a second");
    put("deviceword", hello.kind === "file" ? "of the recording" : !wrong && pace ? `all well · ${pace.value.split(" ")[0]} pairs a second` : "");
    if (wrong !== this.wrong) $("device").open = this.wrong = wrong;
    $("device").hidden = !facts.length && !this.options.length;
    $("openset").hidden = !this.options.length;
    $("centre").hidden = !device.can_centre;
    $("facts").replaceChildren(...facts.flatMap(({ name, value, warn, share, title = "" }) => [make("dt", { textContent: name, title }), told(value, warn, share)]));
  }

  open() {
    this.pickers = this.options.map(([name, { value, allowed, title }]) => {
      const options = allowed.map((one) => make("option", { textContent: one, selected: one === value }));
      return { name, value, allowed, title, select: make("select", {}, ...options) };
    });
    $("options").replaceChildren(...this.pickers.map(({ title, select }) => make("label", {}, `${title} `, select)));
    ask($("set"), () => this.send());
  }

  send() {
    const changed = this.pickers.map(({ name, value, allowed, select }) => [name, allowed[select.selectedIndex], value]).filter(([, now, before]) => now !== before);
    if (changed.length) this.say({ do: "device", ...Object.fromEntries(changed.map(([name, now]) => [name, now])) });
  }
}

function told(value, warn, share) {
  const parts = typeof share === "number" ? [make("i", { style: `--v: ${100 * share}%` }), make("em", { textContent: value })] : [value];
  return make("dd", { className: warn ? "warn" : "" }, ...parts);
}
