// The device: its facts, and what can be set on it.

import { $, ask, make, put } from "./dom.js";

export class Device {
  constructor(say) {
    this.say = say;
    $("openset").onclick = () => this.open();
  }

  // One line while all is well; it opens at a warning.
  update(type, { device, hello }) {
    if (type !== "device" && type !== "hello") return;
    this.options = Object.entries(device.options ?? {});
    const facts = device.facts ?? [];
    const wrong = facts.some(({ warn }) => warn), pace = facts.find(({ name }) => name === "Pairs a second");
    put("deviceword", hello.kind === "file" ? "of the recording" : !wrong && parseFloat(pace?.value) ? `all well · ${pace.value.split(" ")[0]} pairs a second` : "");
    if (wrong !== this.wrong) $("device").open = this.wrong = wrong;
    $("device").hidden = !facts.length && !this.options.length;
    $("openset").hidden = !this.options.length;
    $("centre").hidden = !device.can_centre;
    $("facts").replaceChildren(...facts.flatMap(({ name, value, warn, share, title = "" }) => [make("dt", { textContent: name, title }), told(value, warn, share)]));
  }

  open() {
    const { options } = this, selects = options.map(([, { value, allowed }]) => make("select", {}, ...allowed.map((one) => new Option(one, one, false, one === value))));
    $("options").replaceChildren(...options.map(([, { title }], i) => make("label", {}, `${title} `, selects[i])));
    ask($("set"), () => {
      const changed = options.map(([name, { allowed }], i) => [name, allowed[selects[i].selectedIndex]]).filter(([, now], i) => now !== options[i][1].value);
      if (changed.length) this.say({ do: "device", ...Object.fromEntries(changed) });
    });
  }
}

function told(value, warn, share) {
  const parts = typeof share === "number" ? [make("i", { style: `--v: ${100 * share}%` }), make("em", { textContent: value })] : [value];
  return make("dd", { className: warn ? "warn" : "" }, ...parts);
}
