// Guided calibration in words: the verdict, what is next, eq. (2) so far. The plot is a chart.

import { escaped } from "./charts/svg.js";
import { $ } from "./dom.js";
import { inUnit } from "./formatting.js";

const WORDS = { rigid_ratio: "rigid object", half_modulus: "half-way at", soft_ratio: "soft object" };

export class Calibrating {
  constructor(say) {
    $("calibrate").onclick = () => say({ do: "calibrating", on: !this.on });
    $("fitwords").onclick = ({ target }) => target.matches("button") && say({ do: "save calibration" });
  }

  update(type, { calibration }) {
    if (type !== "calibration") return;
    this.on = Boolean(calibration.on);
    $("calibrate").ariaPressed = String(this.on);
    document.body.classList.toggle("calibrating", this.on);
    $("touch").hidden = this.on;
    $("fit").hidden = !this.on;
    if (this.on) $("fitwords").innerHTML = words(calibration);
  }
}

// At the end of the session the calibration is saved without an order.
function words({ verdict, next, parameters = [], points = [], saved, sound }) {
  const out = points.filter(({ kept }) => !kept).map(({ touch }) => `touch ${touch}`).join(", ");
  const save = `<p class="row"><button type="button" class="${sound ? "strong" : ""}">Save the calibration</button></p>`;
  const rows = parameters.map(({ name, ...one }) => {
    const texts = /MPa/.test(one.value) ? [one.value, one.interval].map(inUnit) : [one.value, one.interval];
    return `<tr title="${name} in eq. (2) of the paper">${[WORDS[name] ?? name, ...texts].map((text) => `<td>${escaped(text)}</td>`).join("")}</tr>`;
  });
  const table = `<table><thead><tr><th>Curve</th><th>value</th><th>95 % interval</th></tr></thead><tbody>${rows.join("")}</tbody></table>`;
  return strong(verdict) + strong(next) + (saved ? `<p>✓ Saved as ${escaped(saved)}; it is used from now on.</p>` : save) + (rows.length ? table : "") + (out && `<p class="bad">× left out: ${out}</p>`);
}

// The first sentence stands out.
const strong = (text) => (text ? `<p>${escaped(text).replace(/^.*?(?:[.:](?= |$)|$)/s, "<b>$&</b>")}</p>` : "");
