// Axes and labels: steps of axes, and places of labels: next to what they name, inside the edges, and none over another.

const TIMES = [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 28800, 86400];

// The smallest 1, 2 or 5 times a power of ten that fits into the span at most `most` times.
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
  const first = Math.ceil(from / step - 1e-9);
  const found = [];
  for (let k = first; k * step <= to + step * 1e-9; k++) found.push(k * step);
  return found;
}

// These digits times powers of ten, as far as their logarithms are in [from, to].
export function decades(from, to, digits) {
  const powers = ticks(Math.floor(from), to, 1).flatMap((e) => digits.map((one) => one * 10 ** e));
  return powers.filter((one) => Math.log10(one) >= from - 1e-9 && Math.log10(one) <= to + 1e-9);
}

export function placesOf(step) {
  return Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
}

const ELLIPSIS = "…";
const SPACE = 2; // pixels between labels in a row

// wanted: [{ text, width, height, places: [[x, y], ...] (left edge, middle; the best first) }], the most important first.
// Returns those that have room, each with x, y.
export function placed(wanted, { left, right, top, bottom }) {
  const found = [];
  const taken = [];
  for (const label of wanted) {
    const boxes = label.places.map(([x, y]) => ({
      x,
      y: y - label.height / 2,
      width: label.width,
      height: label.height,
    }));
    const box = boxes.find(
      (one) =>
        one.x >= left &&
        one.x + one.width <= right &&
        one.y >= top &&
        one.y + one.height <= bottom &&
        !taken.some((other) => meet(one, other)),
    );
    if (!box) continue;
    taken.push(box);
    found.push({ ...label, x: box.x, y: box.y + label.height / 2 });
  }
  return found;
}

function meet(a, b) {
  return (
    a.x < b.x + b.width + SPACE &&
    b.x < a.x + a.width + SPACE &&
    a.y < b.y + b.height &&
    b.y < a.y + a.height
  );
}

// The longest begin of a text that is no wider than `most`.
export function shortened(text, most, measure) {
  if (measure(text) <= most) return text;
  const letters = [...text];
  while (letters.length && measure(letters.join("") + ELLIPSIS) > most) letters.pop();
  return letters.join("") + ELLIPSIS;
}
