// A canvas that fills its place, sharp on every screen, in the colours of the theme.

import { make } from "../dom.js";

// Keeps the width and height of an element as `size` of its chart, since to ask for them would lay out the whole page; and calls.
export function observed(place, chart, call) {
  chart.size = [0, 0];
  new ResizeObserver(() => call((chart.size = [place.clientWidth, place.clientHeight]))).observe(
    place,
  );
}

// Where in an element a pointer is.
export function inside(place, { clientX, clientY }) {
  const { left, top } = place.getBoundingClientRect();
  return [clientX - left, clientY - top];
}

// Charts grow with the text: 1 at 15 px.
export function unit() {
  return parseFloat(getComputedStyle(document.documentElement).fontSize) / 15;
}

export class Canvas {
  constructor(place, resized) {
    this.element = make("canvas", { role: "img" });
    this.context = this.element.getContext("2d");
    this.place = place;
    place.append(this.element);
    observed(place, this, resized);
  }

  colour(name) {
    if (!this.colours.has(name))
      this.colours.set(name, getComputedStyle(this.place).getPropertyValue(`--${name}`).trim());
    return this.colours.get(name);
  }

  // Empties the canvas, for colours and sizes as the theme has them now; false if it has no room.
  begin() {
    const [width, height] = this.size;
    const dpr = devicePixelRatio;
    if (width < 40 || height < 20) return false;
    this.colours = new Map();
    this.unit = unit();
    this.font = `${Math.round(12 * this.unit)}px system-ui, sans-serif`;
    const [w, h] = [Math.round(width * dpr), Math.round(height * dpr)];
    if (this.element.width !== w || this.element.height !== h)
      Object.assign(this.element, { width: w, height: h });
    Object.assign(this, { width, height });
    this.context.setTransform(dpr, 0, 0, dpr, 0, 0);
    this.context.clearRect(0, 0, width, height);
    this.context.font = this.font;
    this.context.lineJoin = "bevel";
    return true;
  }

  set name(text) {
    if (this.element.ariaLabel !== text) this.element.ariaLabel = text;
  }

  fill(name, x, y, width, height, opacity = 1) {
    this.context.globalAlpha = opacity;
    this.context.fillStyle = this.colour(name);
    this.context.fillRect(x, y, width, height);
    this.context.globalAlpha = 1;
  }

  line(name, x1, y1, x2, y2, { dash = [], width = 1 } = {}) {
    const sharp = width === 1 ? (v) => Math.round(v) + 0.5 : (v) => v;
    this.context.setLineDash(dash);
    this.stroke(name, new Path2D(`M${sharp(x1)} ${sharp(y1)}L${sharp(x2)} ${sharp(y2)}`), width);
    this.context.setLineDash([]);
  }

  stroke(name, path, width = 1.6) {
    this.context.strokeStyle = this.colour(name);
    this.context.lineWidth = width;
    this.context.stroke(path);
  }

  // Hatched, as a gap is.
  hatch(x, y, width, height) {
    const path = new Path2D();
    const first = Math.floor((x - height) / 7) * 7; // lines stand still while the gap moves by whole steps
    for (let k = first; k < x + width; k += 7) {
      path.moveTo(k, y + height);
      path.lineTo(k + height, y);
    }
    this.clipped(x, y, width, height, () => this.stroke("quiet", path, 1.5));
  }

  // What is outside of the box is not drawn.
  clipped(x, y, width, height, draw) {
    const { context } = this;
    context.save();
    context.beginPath();
    context.rect(x, y, width, height);
    context.clip();
    draw();
    context.restore();
  }

  // Text, its left edge (or as `align` says) at x, its middle at y. back: it covers what is behind it.
  text(text, x, y, { colour = "quiet", bold = false, align = "left", back = false } = {}) {
    const { context } = this;
    if (back)
      this.fill(
        "card",
        x - 1,
        y - 7 * this.unit,
        this.measure(text, bold) + 2,
        14 * this.unit,
        0.72,
      );
    context.font = bold ? `600 ${this.font}` : this.font;
    context.textAlign = align;
    context.textBaseline = "middle";
    context.fillStyle = this.colour(colour);
    context.fillText(text, x, y);
  }

  // Width of a text, px.
  measure(text, bold = false) {
    this.context.font = bold ? `600 ${this.font}` : this.font;
    return this.context.measureText(text).width;
  }
}
