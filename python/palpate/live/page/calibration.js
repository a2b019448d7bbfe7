// Guided calibration in words: the verdict, what is next, eq. (2) so far. The plot is a chart.

import { $, make } from "./dom.js";
import { inUnit } from "./formatting.js";

const WORDS = { rigid_ratio: "rigid object", half_modulus: "half-way at", soft_ratio: "soft object" };

export class Calibrating {
  constructor(say) {
    this.say = say;
    $("calibrate").onclick = () => say({ do: "calibrating", on: !this.on });
  }

  tell(type, { calibration }) {
    if (type !== "calibration") return;
    this.on = Boolean(calibration.on);
    $("calibrate").ariaPressed = String(this.on);
    document.body.classList.toggle("calibrating", this.on);
    $("touch").hidden = this.on;
    $("fit").hidden = !this.on;
    if (this.on) $("fitwords").replaceChildren(...this.words(calibration));
  }

  words({ verdict, next, parameters, points, saved, sound }) {
    const out = (points ?? []).filter(({ kept }) => !kept);
    return [
      ...strong(verdict), ...strong(next), this.saving(saved, sound),
      ...(parameters?.length ? [table(parameters)] : []),
      ...(out.length ? [make("p", { className: "bad", textContent: `× left out: ${out.map(({ touch }) => `touch ${touch}`).join(", ")}` })] : []),
    ];
  }

  // At the end of the session it is saved without an order.
  saving(saved, sound) {
    const save = make("button", { type: "button", textContent: "Save the calibration", className: sound ? "strong" : "", onclick: () => this.say({ do: "save calibration" }) });
    return saved ? make("p", { textContent: `✓ Saved as ${saved}; it is used from now on.` }) : make("p", { className: "row" }, save);
  }
}

// The first sentence stands out.
function strong(text) {
  if (!text) return [];
  const [, first, rest] = text.match(/^(.*?[.:](?= |$))(.*)$/s) ?? [null, text, ""];
  return [make("p", {}, make("b", { textContent: first }), rest)];
}

function table(parameters) {
  const head = make("tr", {}, ...["Curve", "value", "95 % interval"].map((text, i) => make("th", { textContent: text, className: i ? "" : "name" })));
  const rows = parameters.map(({ name, value, interval }) => make("tr", {}, ...[WORDS[name] ?? name, ...(/MPa/.test(value) ? [value, interval].map(inUnit) : [value, interval])].map((text) => make("td", { textContent: text, title: `${name} in eq. (2) of the paper` }))));
  return make("table", {}, make("thead", {}, head), make("tbody", {}, ...rows));
}
