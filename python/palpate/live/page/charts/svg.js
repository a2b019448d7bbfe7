// Charts of few points as SVG text: they take the colours of the theme by their classes, and print sharply.

import { make } from "../dom.js";
import { Hover } from "./readout.js";
import { inside, observed } from "./canvas.js";

const ruler_ = document.createElement("canvas").getContext("2d");

export function escaped(text) {
  return String(text).replace(/[&<>"']/g, (sign) => `&#${sign.charCodeAt(0)};`);
}

const path = (points) => `M${points.map(([x, y]) => `${x.toFixed(1)} ${y.toFixed(1)}`).join("L")}`;

// What is drawn has a colour of the theme, by its name.
export const line = (points, colour, width = 2.2) =>
  points.length > 1
    ? `<path d="${path(points)}" fill="none" stroke="var(--${colour})" stroke-width="${width}" stroke-linejoin="round"/>`
    : "";

export const area = (upper, lower, colour) =>
  upper.length > 1
    ? `<path d="${path([...upper, ...lower.toReversed()])}Z" fill="var(--${colour})"/>`
    : "";

export const label = (x, y, text, name = "", anchor = "start") =>
  `<text x="${x.toFixed(1)}" y="${y.toFixed(1)}" class="${name}" text-anchor="${anchor}">${escaped(text)}</text>`;

export const ruler = (x1, y1, x2, y2, colour, { width = 1, dash = "" } = {}) =>
  `<line x1="${x1.toFixed(1)}" y1="${y1.toFixed(1)}" x2="${x2.toFixed(1)}" y2="${y2.toFixed(1)}" stroke="var(--${colour})" stroke-width="${width}" stroke-dasharray="${dash}"/>`;

export const box = (x, y, width, height, colour) =>
  `<rect x="${x.toFixed(1)}" y="${y.toFixed(1)}" width="${width.toFixed(1)}" height="${height.toFixed(1)}" fill="var(--${colour})"/>`;

// Lines at these values of an axis that goes up, each with its text at the left.
export function valueAxis(values, { k, left, right }, y, textOf, isZero = () => false) {
  const lines = values.map((value) => {
    const at = y(value);
    const line = ruler(left, at, right, at, isZero(value) ? "past" : "grid");
    return line + label(left - 6, at + 4 * k, textOf(value), "", "end");
  });
  return lines.join("");
}

// What is outside of the box is not drawn.
export const clipped = (x, y, width, height, inner) =>
  `<svg x="${x}" y="${y}" width="${Math.max(0, width)}" height="${Math.max(0, height)}" viewBox="${x} ${y} ${Math.max(1, width)} ${Math.max(1, height)}">${inner}</svg>`;

// The newest one stands out.
export function dot(x, y, radius, newest, colour, title = "") {
  const look = newest
    ? `fill="var(--ratio)" stroke="var(--card)" stroke-width="1.5"`
    : `fill="var(--${colour})"`;
  return `<circle cx="${x.toFixed(1)}" cy="${y.toFixed(1)}" r="${radius.toFixed(1)}" ${look}><title>${escaped(title)}</title></circle>`;
}

// Width of a text of the charts, px.
export function measure(text, unit) {
  ruler_.font = `600 ${12 * unit}px system-ui, sans-serif`;
  return ruler_.measureText(text).width;
}

// A chart as SVG. It fills its place, lies below the values at the pointer, and may say by at(x, y) what they are:
// { x, lines }, or null.
export class SvgChart {
  // charts: Charts, which draw it by the name of its place
  constructor(place, charts) {
    Object.assign(this, { place, charts, holder: make("div") });
    place.prepend(this.holder);
    observed(place, this, () => charts.redraw(place.id));
    const hover = new Hover(place);
    place.addEventListener("pointermove", (event) => {
      const found = this.at?.(...inside(place, event));
      if (found) hover.show(found.x, found.lines);
      else hover.hide();
    });
    place.addEventListener("pointerleave", () => hover.hide());
  }

  show(inner, name) {
    const [w, h] = this.size;
    this.holder.innerHTML = `<svg width="${w}" height="${h}" viewBox="0 0 ${w} ${h}" role="img" aria-label="${escaped(name)}">${inner}</svg>`;
  }

  // A sentence in place of the chart.
  write(sentence) {
    this.holder.replaceChildren(make("p", { className: "empty", textContent: sentence }));
  }
}
