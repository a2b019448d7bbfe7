// Recordings beside each other: the answer, and a row for each specimen with a lane for each recording.

import { box, escaped, ruler } from "./charts/svg.js";
import { $ } from "./dom.js";
import { grouped, number, plusMinus, signed } from "./formatting.js";

const LETTERS = "ABCD", LANE = 7; // px
const REACHES = [0.1, 0.2, 0.5, 1]; // of the mean, both ways: the smallest that has all touches, or the last one
const PATHS = ["M-3 0a3 3 0 1 0 6 0a3 3 0 1 0-6 0", "M-3-3h6v6h-6z", "M0-3.5l3.5 6h-7z", "M0-4l4 4l-4 4l-4-4z"];

export class Compare {
  constructor(say, answer) {
    this.answer = answer;
    $("opencompare").onclick = () => say({ do: "compare" }) && answer("The recordings are being read.");
    addEventListener("resize", () => this.open && this.draw());
    $("compare").onclick = ({ target }) => {
      if (target.closest(".close")) this.turn(false);
      else if (target.closest("[data-at]")) this.choose(Number(target.closest("[data-at]").dataset.at));
    };
  }

  // A file that was opened with others is compared at once.
  update(type, { hello, state }) {
    if (type !== "state") return;
    $("opencompare").hidden = !(state.comparable > 1);
    if (hello.kind === "file" && state.comparable > 1 && !this.asked) $("opencompare").click(this.asked = true);
  }

  show(found) {
    this.answer("");
    this.found = found;
    this.turn(true);
    this.choose(Math.max(0, found.specimens.findIndex(differs)));
  }

  turn(on) {
    this.open = on;
    $("compare").hidden = !on;
    document.body.classList.toggle("comparing", on);
    scrollTo(0, 0);
  }

  // The next specimen whose touches differ.
  next() {
    const { specimens } = this.found, after = specimens.map((_, i) => (this.at + 1 + i) % specimens.length).find((i) => differs(specimens[i]));
    if (after !== undefined) this.choose(after);
  }

  choose(at) {
    this.at = at;
    this.draw();
    $("compare").querySelector("tr.chosen button").focus();
  }

  draw() {
    const { files, specimens, agree, of, scatter } = this.found, all = of > 0 && agree === of;
    const away = specimens.flatMap(({ agreement: a, touches }) => touches.filter(counts).map(({ ratio }) => Math.abs(ratio / a.ratio - 1)));
    const size = { wide: Math.max(180, 0.42 * $("compare").clientWidth), reach: REACHES.find((reach) => reach >= Math.max(...away)) ?? REACHES.at(-1) };
    const names = specimens.filter(differs).map(({ name }) => name).join(", ");
    const said = !of ? "no specimen is in two of them" : `specimens agree.${all ? "" : ` Look at ${names}.`}`;
    const file = ({ name, touches, kept }, i) => `<tr>${named(i, name)}<td>${grouped(kept)} of ${grouped(touches)} touches</td></tr>`;
    $("compare").innerHTML = `<div class="card answer"><div class="${all ? "good" : "caution"}"><b>${of ? `${agree} of ${of}` : "–"}</b><p>${escaped(said)}</p></div>
      <table><tr><th class="name">Recording</th><th>count</th></tr>${files.map(file).join("")}</table><button type="button" class="close">Close <kbd>Esc</kbd></button></div>
      <div class="card scroll" tabindex="0" role="region" aria-label="Specimens"><h2>Touches by specimen, % from the mean; bar: mean of a recording; band: 95 % interval of one hand's touches, ${signed(-196 * scatter, 1)} to ${signed(196 * scatter, 1)} %</h2>
      <table><tr><th class="name">Specimen</th><th>${axis(size)}</th><th>Touches</th><th>Mean ratio ± (k = 1)</th><th>Spread, %</th><th>By chance</th><th class="name">They</th></tr>${specimens.map((one, i) => this.row(one, i, size)).join("")}</table></div>
      <div class="card">${this.details(specimens[this.at])}</div>`;
  }

  row({ name, agreement: a, touches, ...one }, i, size) {
    const kept = touches.filter(counts), lanes = kept.length ? lanesOf(kept, a.ratio, this.found, size) : "", word = !a ? "none counts" : a.agree ? "✓ agree" : `▲ differ${one.apart ? `: ${LETTERS[one.farthest]}` : ""}`;
    const numbers = a ? [grouped(a.touches), plusMinus(a.ratio, a.standard_error).join(" "), (100 * a.spread).toFixed(1), a.probability < 0.001 ? "&lt; 0.1 %" : `${(100 * a.probability).toFixed(1)} %`] : ["0", "–", "–", "–"];
    const button = `<button type="button" class="plain" data-at="${i}" aria-current="${i === this.at}">${escaped(name)}</button>`;
    return `<tr data-at="${i}" class="${i === this.at ? "chosen" : ""}"><td class="name">${button}</td><td>${lanes}</td>${numbers.map((text) => `<td>${text}</td>`).join("")}<td class="name ${a?.agree ? "" : "bad"}">${word}</td></tr>`;
  }

  // The touches of the chosen specimen, recording by recording.
  details({ name, agreement, touches, farthest, apart }) {
    const said = !agreement ? "no touch counts" : agreement.agree || !apart ? agreement.text : `▲ recording ${LETTERS[farthest]} is ${Math.abs(100 * apart).toFixed(1)} % ${apart > 0 ? "above" : "below"} the others`;
    const line = (file, i) => {
      const own = touches.filter((one) => one.file === i), kept = own.filter(counts), mean = kept.length ? meanOf(kept) : null;
      const each = own.map(({ number: n, ratio, left_out: out }) => `<span class="${out ? "out" : ""}" title="${escaped(out)}">#${n} ${number(ratio, 0.03 * ratio)}</span>`), out = own.filter((one) => !counts(one)).map((one) => `▲ #${one.number} ${one.left_out.split(":")[0]}`);
      return `<tr>${named(i, file.name)}<td class="name">${each.join("")}</td><td>${mean ? number(mean, 0.03 * mean) : "–"}</td><td>${mean ? signed(100 * (mean / agreement.ratio - 1), 1) : "–"}</td><td class="name bad">${escaped(out.join("; "))}</td></tr>`;
    };
    const head = `<tr><th class="name">Recording</th><th class="name">Touches</th><th>Mean</th><th>From all, %</th><th class="name">Left out</th></tr>`;
    return `<h2>${escaped(`${name}: ${said}`)} <span class="right">Next that differs <kbd>N</kbd></span></h2><table>${head}${this.found.files.map(line).join("")}</table>`;
  }
}

const differs = ({ agreement }) => agreement?.agree === false, counts = ({ left_out: out }) => !out;
const meanOf = (touches) => touches.reduce((sum, { ratio }) => sum + ratio, 0) / touches.length;
const shape = (i, x, y) => `<path fill="var(--c${i + 1})" transform="translate(${x} ${y})" d="${PATHS[i]}"/>`;
const named = (i, name) => `<td class="name"><svg width="16" height="12" aria-hidden="true">${shape(i, 6, 6)}</svg>${LETTERS[i]} · ${escaped(name)}</td>`;
const place = (share, { wide, reach }) => wide / 2 + (Math.max(-reach, Math.min(reach, share)) / reach) * (wide / 2 - 8);

// A lane for each recording: its touches, and their mean as a bar.
function lanesOf(touches, mean, { files, scatter }, size) {
  const { wide } = size, x = (ratio) => place(ratio / mean - 1, size), edge = place(-1.96 * scatter, size), high = LANE * files.length + 2;
  const lanes = files.map((_, i) => {
    const own = touches.filter(({ file }) => file === i), y = LANE * (i + 0.5) + 2, bar = own.length ? box(x(meanOf(own)) - 1.5, y - 5, 3, 10, `c${i + 1}`) : "";
    return own.map(({ ratio }) => shape(i, x(ratio), y)).join("") + bar;
  });
  return `<svg width="${wide}" height="${high}" aria-hidden="true">${box(edge, 0, wide - 2 * edge, high, "fband")}${ruler(wide / 2, 0, wide / 2, high, "past")}${lanes.join("")}</svg>`;
}

function axis(size) {
  const marks = (size.wide < 300 ? [-1, 0, 1] : [-1, -0.5, 0, 0.5, 1]).map((d) => `<text x="${place(d * size.reach, size)}" y="12" text-anchor="${["start", "middle", "end"][Math.trunc(d) + 1]}">${d ? `${signed(100 * d * size.reach, 0)} %` : "0"}</text>`);
  return `<svg width="${size.wide}" height="16">${marks.join("")}</svg>`;
}
