// The specimens of the Lab: how far each one is, the next one, and the touch that is shown: left out or kept.

import { box, dot, escaped, label, ruler } from "./charts/svg.js";
import { $, aligned, make, put } from "./dom.js";
import { inUnit, places } from "./formatting.js";
import { meantTouch } from "./reading.js";

const REACH = 0.08; // of the mean, at the edge of the small plot
const WIDE = 124;
const HIGH = 18;
const SHOWN_BY = ["session", "hello", "touches", "chosen"];

export class Session {
  constructor(known, send) {
    this.known = known;
    this.send = send;
    $("discard").onclick = () => this.turn();
    $("unknown").onclick = () => this.next();
  }

  update(type, known) {
    if (SHOWN_BY.includes(type)) this.show(known);
  }

  // Leaves the touch that is shown out, or takes it back.
  turn() {
    const touch = meantTouch(this.known);
    if (touch) this.send({ do: touch.kept ? "discard" : "keep", touch: touch.number });
  }

  show({ session, hello }) {
    const { title, specimens, count } = session;
    const file = hello.kind === "file";
    put("sessiontitle", title ?? "");
    put("sessioncount", count?.of ? `${count.kept} of ${count.of} touches` : "");
    const longest = Math.max(0, ...specimens.map(({ modulus }) => places(inUnit(modulus ?? ""))));
    $("specimens").replaceChildren(...specimens.map((one) => this.row(one, longest)));
    const list = $("specimens").closest(".list");
    const here = $("specimens").querySelector(".here") ?? $("specimens").lastElementChild;
    list.hidden = !specimens.length;
    if (session.next?.name !== this.here) list.scrollTop = (here?.offsetTop ?? 0) - list.clientHeight / 2;
    this.here = session.next?.name;
    $("onemore").hidden = file;
    $("onemore").disabled = !specimens.length;
    this.showButtons();
  }

  showButtons() {
    const touch = meantTouch(this.known);
    let words = "Leave out";
    if (touch) words = touch.kept ? `Leave ${touch.number} out` : `Take ${touch.number} back`;
    for (const id of ["discard", "leave"]) {
      $(id).disabled = !touch;
      put(id, words);
    }
  }

  // The specimen behind the next one; behind the last one the first. When all are done: none, for other objects.
  next() {
    const { specimens, next } = this.known.session;
    if (!specimens.length) return;
    if (this.known.finished) {
      this.known.finished = null;
      if (this.known.calibration.on) this.send({ do: "calibrating", on: false });
      this.send({ do: "specimen", name: "" });
      return;
    }
    const at = specimens.findIndex(({ name }) => name === next?.name);
    this.send({ do: "specimen", name: specimens[(at + 1) % specimens.length].name });
  }

  row({ name, modulus, kept, of, deviations }, longest) {
    const { session, hello } = this.known;
    const here = session.next?.name === name;
    const measured = deviations.filter(({ deviation }) => deviation !== null);
    const words = measured.map(({ touch, deviation, kept: is }) => `touch ${touch} ${(100 * deviation).toFixed(1)} %${is ? "" : ", left out"}`);
    const name_ = escaped(`${name}: ${words.join("; ") || "no touch"}`);
    const plot = `<svg viewBox="0 0 ${WIDE} ${HIGH}" role="img" aria-label="${name_}">${measured.length ? dots(measured, hello.scatter) : ""}</svg>`;
    const button = make("button", {
      type: "button",
      className: "plain",
      textContent: name,
      disabled: hello.kind === "file",
      ariaCurrent: here ? "true" : null,
      onclick: () => this.send({ do: "specimen", name }),
    });
    return make(
      "tr",
      { className: here ? "here" : "" },
      make("td", { className: "name" }, button),
      make("td", {}, modulus ? aligned(inUnit(modulus), longest) : "?"),
      make("td", { className: "name", innerHTML: plot }),
      make("td", { textContent: `${kept >= of ? "✓ " : ""}${kept}/${of}` }),
    );
  }
}

// Distances from the mean; beyond the edge of the plot: an arrow.
function dots(measured, scatter) {
  const x = (d) => WIDE / 2 + (d / REACH) * (WIDE / 2 - 6);
  const drawn = [];
  if (scatter) drawn.push(box(x(-scatter), 2, x(scatter) - x(-scatter), HIGH - 4, "fband"));
  drawn.push(ruler(WIDE / 2, 1, WIDE / 2, HIGH - 1, "past"));
  for (const { deviation, kept } of measured.toSorted((a, b) => b.kept - a.kept)) {
    const beyond = Math.abs(deviation) > REACH;
    const edge = x(Math.sign(deviation) * REACH);
    if (beyond) drawn.push(label(edge, HIGH / 2 + 4, deviation > 0 ? "▸" : "◂", kept ? "value" : "leftout", "middle"));
    else if (kept) drawn.push(dot(x(deviation), HIGH / 2, 3, false, "hard"));
    else drawn.push(label(x(deviation), HIGH / 2 + 4, "×", "leftout", "middle"));
  }
  return drawn.join("");
}
