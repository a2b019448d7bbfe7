// Places of labels: each beside what it names, none over another, none beyond the edges.

const ELLIPSIS = "…";

// wanted: [{ text, width, height, places: [[x, y], ...] (left edge, middle; the best first) }], the most important first.
// Returns those that have room, each with x, y; taken: boxes that are there already, and these.
export function placed(wanted, { left, right, top, bottom }, taken = []) {
  const found = [];
  for (const label of wanted) {
    const boxes = label.places.map(([x, y]) => ({ x, y: y - label.height / 2, width: label.width, height: label.height }));
    const box = boxes.find((one) => one.x >= left && one.x + one.width <= right && one.y >= top && one.y + one.height <= bottom && !taken.some((other) => meet(one, other)));
    if (!box) continue;
    taken.push(box);
    found.push({ ...label, x: box.x, y: box.y + label.height / 2 });
  }
  return found;
}

export function meet(a, b, space = 2) {
  return a.x < b.x + b.width + space && b.x < a.x + a.width + space && a.y < b.y + b.height && b.y < a.y + a.height;
}

// The longest begin of a text that is no wider than `most`.
export function shortened(text, most, measure) {
  if (measure(text) <= most) return text;
  const letters = [...text];
  let low = 0, high = letters.length;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (measure(letters.slice(0, middle).join("") + ELLIPSIS) <= most) low = middle;
    else high = middle - 1;
  }
  return letters.slice(0, low).join("") + ELLIPSIS;
}

// A text in lines that are no wider than `most`; the last one of them is shortened.
export function wrapped(text, most, lines, measure) {
  const found = [""];
  for (const word of text.split(" ")) {
    const longer = found.at(-1) ? `${found.at(-1)} ${word}` : word;
    if (measure(longer) <= most || !found.at(-1) || found.length === lines) found[found.length - 1] = longer;
    else found.push(word);
  }
  return found.map((one) => shortened(one, most, measure));
}
