// Steps of axes, and times as text.

const TIMES = [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 28800, 86400];

// The smallest 1, 2 or 5 times a power of ten of which at most `most` fit into the span.
export function stepOf(span, most) {
  const power = 10 ** Math.floor(Math.log10(span / most));
  return [1, 2, 5, 10].map((k) => k * power).find((step) => span / step <= most * (1 + 1e-9));
}

export function timeStep(span, most) {
  const found = span < most ? stepOf(span, most) : TIMES.find((step) => span / step <= most);
  return found ?? Math.ceil(span / most / 86400) * 86400;
}

// Multiples of the step in [from, to], each from its index: steps of 0.1 do not add up.
export function ticks(from, to, step) {
  const first = Math.ceil(from / step - 1e-9), found = [];
  for (let k = first; k * step <= to + step * 1e-9; k++) found.push(k * step);
  return found;
}

export function placesOf(step) {
  return Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
}

// mm:ss, or h:mm:ss.
export function clock(seconds, places = 0) {
  const units = Math.round(Math.abs(seconds) * 10 ** places), all = Math.floor(units / 10 ** places);
  const [h, m, s] = [Math.floor(all / 3600), Math.floor(all / 60) % 60, all % 60].map((v) => String(v).padStart(2, "0"));
  const part = places ? `.${String(units % 10 ** places).padStart(places, "0")}` : "";
  return `${seconds < 0 && units ? "−" : ""}${all >= 3600 ? `${Number(h)}:` : ""}${m}:${s}${part}`;
}

// With its sign, a true minus; zero has none.
export function signed(value, places) {
  const text = Math.abs(value).toFixed(places);
  return (Number(text) === 0 ? "" : value < 0 ? "−" : "+") + text;
}
