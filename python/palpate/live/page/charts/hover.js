// The read-out beside the pointer: a hair line, and the values there.

export class Hover {
  constructor(place) {
    this.place = place;
    place.classList.add("plot");
    this.hair = place.appendChild(document.createElement("i"));
    this.tip = place.appendChild(document.createElement("p"));
    this.hair.className = "hair";
    this.tip.className = "tip";
    this.hair.ariaHidden = this.tip.ariaHidden = "true"; // the numbers are in the table, and in the cursors' read-out
    this.hide();
  }

  // lines: texts, the first is what they belong to.
  show(x, lines) {
    this.tip.replaceChildren(...lines.map((text) => Object.assign(document.createElement("span"), { textContent: text })));
    this.hair.hidden = this.tip.hidden = false;
    const most = this.place.clientWidth, width = this.tip.offsetWidth;
    this.hair.style.left = `${x}px`;
    this.tip.style.left = `${Math.max(0, x + 10 + width <= most ? x + 10 : x - 10 - width)}px`;
  }

  hide() {
    this.hair.hidden = this.tip.hidden = true;
  }
}

// For charts that are drawn anew as text: says what is at the pointer. find(x, y) -> { x, lines } or null.
export function hovering(place, find) {
  const hover = new Hover(place);
  place.addEventListener("pointermove", (event) => {
    const box = place.getBoundingClientRect(), found = find(event.clientX - box.left, event.clientY - box.top);
    if (found) hover.show(found.x, found.lines);
    else hover.hide();
  });
  place.addEventListener("pointerleave", () => hover.hide());
}
