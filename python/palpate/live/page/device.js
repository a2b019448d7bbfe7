// The device: its facts, and what can be set on it.

import { $, ask, make, put } from "./dom.js";

export class Device {
  constructor(send) {
    this.send = send;
    $("openset").onclick = () => this.open();
  }

  // One line, which says what is wrong; only a person opens it, so that it moves nothing.
  update(type, { device, hello }) {
    if (type !== "device" && type !== "hello") return;
    this.options = Object.entries(device.options ?? {});
    const facts = device.facts ?? [];
    const wrong = facts.find(({ warn }) => warn);
    put("deviceword", summary(facts, wrong, hello));
    $("deviceword").className = wrong ? "bad" : "";
    $("device").hidden = !facts.length && !this.options.length;
    $("openset").hidden = !this.options.length;
    $("centre").hidden = !device.can_centre;
    const lines = facts.flatMap(({ name, value, warn, share, title = "" }) => [
      make("dt", { textContent: name, title }),
      valueCell(value, warn, share),
    ]);
    $("facts").replaceChildren(...lines);
  }

  open() {
    const { options } = this;
    const selects = options.map(([, { value, allowed }]) => {
      return make(
        "select",
        {},
        ...allowed.map((one) => new Option(one, one, false, one === value)),
      );
    });
    const labels = options.map(([, { title }], i) => make("label", {}, `${title} `, selects[i]));
    $("options").replaceChildren(...labels);
    ask($("set"), () => {
      const changed = {};
      options.forEach(([name, { allowed, value }], i) => {
        const chosen = allowed[selects[i].selectedIndex];
        if (chosen !== value) changed[name] = chosen;
      });
      if (Object.keys(changed).length) this.send({ do: "device", ...changed });
    });
  }
}

function summary(facts, wrong, hello) {
  if (hello.kind === "file") return "of the recording";
  if (wrong) return `▲ ${wrong.name}: ${wrong.value}`;
  const rate = parseFloat(facts.find(({ name }) => name === "Pairs a second")?.value);
  return rate ? `all well · ${rate.toFixed(0)} pairs a second` : "";
}

function valueCell(value, warn, share) {
  const cell = make("dd", { className: warn ? "warn" : "" });
  if (typeof share === "number") {
    const bar = make("i", { style: `--v: ${100 * share}%` });
    cell.append(bar, make("em", { textContent: value }));
  } else {
    cell.append(value);
  }
  return cell;
}
