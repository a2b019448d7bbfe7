// Guided calibration in words: the verdict, what is next, what is missing, eq. (2) so far. The plot is a chart.

import { $, make } from "./dom.js";

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

  words({ verdict, next, missing, parameters, points, saved, sound }) {
    const say = (text, className = "") => make("p", { textContent: text, className });
    const out = (points ?? []).filter(({ kept }) => !kept);
    return [
      ...strong(verdict), ...strong(next), ...(missing ?? []).map((text) => say(text)),
      this.buttons(saved, sound),
      ...(parameters?.length ? [table(parameters)] : []),
      ...(out.length ? [say(`× left out: ${out.map(({ touch }) => `touch ${touch}`).join(", ")}`, "bad")] : []),
    ];
  }

  buttons(saved, sound) {
    const button = (textContent, strong, onclick) => make("button", { type: "button", textContent, className: strong ? "strong" : "", onclick });
    const save = button(saved ? "Save again" : "Save the calibration", sound && !saved, () => this.say({ do: "save calibration" }));
    const use = button("Measure with it", sound, () => this.say({ do: "calibrating", on: false }));
    return saved ? make("div", {}, make("p", { textContent: `Saved as ${saved}; it is used from now on.` }), make("p", { className: "row" }, use, save)) : make("p", { className: "row" }, save);
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
  const rows = parameters.map(({ name, value, interval }) => make("tr", {}, ...[WORDS[name] ?? name, value, interval].map((text) => make("td", { textContent: text, title: `${name} in eq. (2) of the paper` }))));
  return make("table", {}, make("thead", {}, head), make("tbody", {}, ...rows));
}
