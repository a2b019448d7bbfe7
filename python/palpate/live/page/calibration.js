// Guided calibration in words: the verdict, what is next, eq. (2) so far. The plot is a chart.

import { escaped } from "./charts/svg.js";
import { $ } from "./dom.js";
import { inUnit, sentenceInUnit } from "./formatting.js";

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

// A good calibration is saved without an order at the end of the session.
function words({ verdict, next, parameters = [], points = [], saved, sound, doubts = [], details }) {
  const parts = [strong(verdict), paragraph(next)];
  if (saved) parts.push(paragraph(`✓ ${saved}`));
  else parts.push(`<p class="row"><button type="button" class="${sound ? "strong" : ""}">Save the calibration</button></p>`);
  for (const doubt of doubts) parts.push(paragraph(`▲ ${doubt}`, "bad"));
  if (parameters.length) parts.push(table(parameters));
  const out = points.filter(({ kept }) => !kept).map(({ touch }) => `touch ${touch}`);
  if (out.length) parts.push(paragraph(`× left out: ${out.join(", ")}`, "bad"));
  parts.push(paragraph(details));
  return parts.join("");
}

function table(parameters) {
  const rows = parameters.map(({ name, value, interval }) => {
    const texts = /MPa/.test(value) ? [value, interval].map(inUnit) : [value, interval];
    const cells = [WORDS[name] ?? name, ...texts].map((text) => `<td>${escaped(text)}</td>`);
    return `<tr title="${name} in eq. (2) of the paper">${cells.join("")}</tr>`;
  });
  return `<table><thead><tr><th>Curve</th><th>value</th><th>95 % interval</th></tr></thead><tbody>${rows.join("")}</tbody></table>`;
}

function paragraph(text, kind = "") {
  return text ? `<p class="${kind}">${escaped(sentenceInUnit(text))}</p>` : "";
}

// The first sentence stands out.
function strong(text) {
  if (!text) return "";
  const shown = escaped(sentenceInUnit(text));
  return `<p>${shown.replace(/^.*?(?:[.:](?= |$)|$)/s, "<b>$&</b>")}</p>`;
}
