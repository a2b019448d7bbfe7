// Noise of both channels: rms and spectrum, asked for while the panel is open.

import { $ } from "../dom.js";
import { number } from "../formatting.js";
import { decades, placed, shortened } from "./axes.js";
import { unit } from "./sheet.js";
import { SvgChart, clipped, label, line, measure, ruler } from "./svg.js";

const FLOOR = 1e-3; // of the highest value: what is below is not drawn

export class Spectrum extends SvgChart {
  noise = null;
  on = false;

  tell_noise(message) {
    this.noise = message.hz ? message : null;
    this.charts.redraw("spectrum");
  }

  // Perhaps on a new connection.
  tell_hello() {
    if (this.on) this.charts.say({ do: "noise", on: true });
  }

  toggle() {
    const on = (this.on = !this.on);
    this.noise = null;
    $("noise").hidden = !on;
    document.body.classList.toggle("noisy", on);
    $("opennoise").ariaPressed = String(on);
    this.charts.say({ do: "noise", on });
    this.draw();
  }

  draw() {
    const [width, height] = this.size, { noise } = this;
    this.shown = null;
    if (!this.on || width < 80 || height < 60) return;
    if (!noise?.hz.length) return this.write(noise?.text || "The noise is being measured. Do not touch anything.");
    const k = unit(), left = 52 * k, top = 20 * k, foot = height - 18 * k, right = width - 8;
    const { hz } = noise, values = [...noise.hard, ...noise.soft].filter((value) => value > 0);
    const f = [Math.log10(Math.min(...hz.filter((one) => one > 0))), Math.log10(Math.max(...hz))], most = Math.max(...values);
    const v = [Math.floor(Math.log10(Math.max(Math.min(...values), FLOOR * most))), Math.ceil(Math.log10(most) + 0.05)];
    const x = (one) => left + ((Math.log10(one) - f[0]) / Math.max(1e-9, f[1] - f[0])) * (right - left), y = (one) => foot - ((Math.log10(Math.max(one, 1e-30)) - v[0]) / (v[1] - v[0])) * (foot - top);
    this.shown = { x, left, right };
    const curve = (name) => line(hz.map((one, i) => [one, noise[name][i]]).filter(([one, value]) => one > 0 && value > 0).map(([one, value]) => [x(one), y(value)]), name);
    const inner = this.axes({ f, v, x, y, k, left, right, top, foot, height }) + clipped(left, top, right - left, foot - top, curve("soft") + curve("hard")) + this.peaks({ x, y, k, left, right, top, foot });
    this.show(label(0, 12 * k, shortened(noise.text, width, (part) => measure(part, k)), "ink") + inner, `Noise spectrum. ${noise.text}`);
  }

  axes({ f, v, x, y, k, left, right, top, foot, height }) {
    const parts = [label(left + 4, top + 10 * k, "aF/√Hz")];
    for (const one of decades(...v, [1])) parts.push(ruler(left, y(one), right, y(one), "grid") + label(left - 6, y(one) + 4 * k, number(one).replace(/\.0+$/, ""), "", "end"));
    for (const one of decades(...f, [1, 2, 5])) {
      const last = x(one) > right - 30 * k;
      parts.push(ruler(x(one), top, x(one), foot, "grid") + label(last ? right : x(one), height - 4, `${Number(one.toPrecision(1))} Hz`, "", last ? "end" : "middle"));
    }
    return parts.join("");
  }

  // The peaks that stand out, named where they are.
  peaks({ x, y, k, left, right, top, foot }) {
    const wanted = this.noise.peaks.map(({ hz, channel, aF }) => {
      const text = `${number(hz)} Hz, ${number(aF)} aF`, width = measure(text, k), at = x(hz), i = nearest(this.noise.hz, hz);
      const level = Math.max(top + 8 * k, y(this.noise[channel]?.[i] ?? 0) - 9 * k);
      return { text, at, width, height: 13 * k, places: [level, level + 15 * k, level + 30 * k].flatMap((row) => [[at + 5, row], [at - 5 - width, row]]) };
    });
    this.labels = placed(wanted, { left, right, top, bottom: foot });
    return wanted.map(({ at }) => ruler(at, top, at, foot, "mark")).join("") + this.labels.map(({ x: a, y: b, text }) => label(a, b + 4 * k, text, "ink")).join("");
  }

  at(px) {
    if (!this.shown || px < this.shown.left || px > this.shown.right) return null;
    const { hz, hard, soft } = this.noise, { x } = this.shown, i = nearest(hz.map((one) => (one > 0 ? x(one) : -1e9)), px);
    return { x: x(hz[i]), lines: [`${number(hz[i])} Hz`, `hard ${number(hard[i])} aF/√Hz`, `soft ${number(soft[i])} aF/√Hz`] };
  }
}

function nearest(values, value) {
  return values.reduce((best, one, i) => (Math.abs(one - value) < Math.abs(values[best] - value) ? i : best), 0);
}
