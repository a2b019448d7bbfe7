// Recordings beside each other: the answer, and a row for each specimen with a lane for each recording.

import { box, escaped, ruler } from "./charts/svg.js";
import { $ } from "./dom.js";
import { grouped, number, plusMinus, signed } from "./formatting.js";

const LETTERS = "ABCD";
const LANE = 7; // px
const REACHES = [0.1, 0.2, 0.5, 1]; // of the mean, both ways: the smallest that has all touches, or the last one
const SHARE = 0.03; // of a ratio: its digits
const ARROWS = ["M4-4v8l-7-4z", "M-4-4v8l7-4z"]; // a touch beyond the scale, to the left and to the right
const PATHS = [
  "M-3 0a3 3 0 1 0 6 0a3 3 0 1 0-6 0",
  "M-3-3h6v6h-6z",
  "M0-3.5l3.5 6h-7z",
  "M0-4l4 4l-4 4l-4-4z",
];

export class Compare {
  constructor(send, answer) {
    this.answer = answer;
    $("opencompare").onclick = () => {
      if (send({ do: "compare" })) answer("The recordings are being read.");
    };
    addEventListener("resize", () => this.open && this.draw());
    $("compare").onclick = ({ target }) => this.click(target);
  }

  // A file that was opened with others is compared at once.
  update(type, { hello, state }) {
    if (type !== "state") return;
    $("opencompare").hidden = !(state.comparable > 1);
    if (hello.kind !== "file" || !(state.comparable > 1) || this.requested) return;
    this.requested = true;
    $("opencompare").click();
  }

  click(target) {
    const row = target.closest("[data-at]");
    if (target.closest(".close")) this.turn(false);
    else if (target.closest(".same")) this.showSame();
    else if (row) this.choose(Number(row.dataset.at));
  }

  show(found) {
    this.answer("");
    this.found = found;
    this.turn(true);
    const first = found.specimens.findIndex(differs);
    this.choose(Math.max(0, first));
  }

  // All touches as if they were on one object.
  showSame() {
    const { same } = this.found;
    const agree = same.agreement?.agree ? 1 : 0;
    this.found = { ...this.found, specimens: [same], same: null, of: 1, agree, asked: true };
    this.choose(0);
  }

  turn(on) {
    this.open = on;
    $("compare").hidden = !on;
    document.body.classList.toggle("comparing", on);
    scrollTo(0, 0);
  }

  // The next specimen whose touches differ.
  next() {
    const { specimens } = this.found;
    for (let by = 1; by <= specimens.length; by++) {
      const at = (this.at + by) % specimens.length;
      if (differs(specimens[at])) {
        this.choose(at);
        return;
      }
    }
  }

  choose(at) {
    this.at = at;
    this.draw();
    $("compare").querySelector("tr.chosen button").focus();
  }

  draw() {
    const { specimens, scatter } = this.found;
    const away = specimens.flatMap(({ agreement: a, touches }) =>
      touches.filter(counts).map(({ ratio }) => Math.abs(ratio / a.ratio - 1)),
    );
    const reach = REACHES.find((one) => one >= Math.max(...away)) ?? REACHES.at(-1);
    const size = { wide: Math.max(180, 0.42 * $("compare").clientWidth), reach };
    const limits = [-196, 196].map((k) => signed(k * scatter, 1)).join(" to ");
    const title = `Touches by specimen, % from the mean; bar: mean of a recording; band: 95 % interval of one hand's touches, ${limits} %`;
    const heads = `<th class="name">Specimen</th><th>${axis(size)}</th><th>Touches</th><th>Mean ratio ± (k = 1)</th><th>Spread, %</th><th>By chance</th><th class="name">They</th>`;
    const rows = specimens.map((one, i) => this.row(one, i, size)).join("");
    $("compare").innerHTML = `<div class="card answer">${this.answerParts()}</div>
      <div class="card scroll" tabindex="0" role="region" aria-label="Specimens"><h2>${title}</h2><table><tr>${heads}</tr>${rows}</table></div>
      <div class="card">${this.details(specimens[this.at])}</div>`;
  }

  // The answer in words, the recordings, and what can be pressed.
  answerParts() {
    const { files, agree, of, same } = this.found;
    const all = of > 0 && agree === of;
    const rows = files.map(({ name, touches, kept }, i) => {
      return `<tr>${named(i, name)}<td>${grouped(kept)} of ${grouped(touches)} touches</td></tr>`;
    });
    const count = of ? `${agree} of ${of}` : "–";
    const letters = [...LETTERS].slice(0, files.length);
    const pair = `${letters.slice(0, -1).join(", ")} and ${letters.at(-1)}`;
    const question = `<button type="button" class="same strong">Are ${pair} the same object?</button>`;
    return `<div class="${all ? "good" : "caution"}"><b>${count}</b><p>${escaped(this.answerWords(pair))}</p></div>
      <table><tr><th class="name">Recording</th><th>count</th></tr>${rows.join("")}</table>${same ? question : ""}<button type="button" class="close">Close <kbd>Esc</kbd></button>`;
  }

  answerWords(pair) {
    const { specimens, agree, of, asked } = this.found;
    if (!of) return "no specimen is in two of them";
    if (asked && agree) return `${pair} agree: they may be the same object.`;
    if (asked) return `${pair} differ: not the same object, or not touched in the same way.`;
    const names = specimens.filter(differs).map(({ name }) => name);
    return `specimens agree.${names.length ? ` Look at ${names.join(", ")}.` : ""}`;
  }

  row({ name, agreement: a, touches, apart, farthest }, i, size) {
    const kept = touches.filter(counts);
    const lanes = kept.length ? lanesOf(kept, a.ratio, this.found, size) : "";
    const chosen = i === this.at;
    const button = `<button type="button" class="plain" data-at="${i}" aria-current="${chosen}">${escaped(name)}</button>`;
    const numbers = a ? numbersOf(a) : ["0", "–", "–", "–"];
    const cells = numbers.map((text) => `<td>${text}</td>`).join("");
    const differ = `▲ differ${apart ? `: ${LETTERS[farthest]}` : ""}`;
    const word = a ? (a.agree ? "✓ agree" : differ) : "none counts";
    return `<tr data-at="${i}" class="${chosen ? "chosen" : ""}"><td class="name">${button}</td><td>${lanes}</td>${cells}<td class="name ${a?.agree ? "" : "bad"}">${word}</td></tr>`;
  }

  // The touches of the chosen specimen, recording by recording.
  details({ name, agreement, touches, farthest, apart }) {
    const rows = this.found.files.map((file, i) => {
      const own = touches.filter((one) => one.file === i);
      const kept = own.filter(counts);
      const mean = kept.length ? meanOf(kept) : null;
      const each = own.map(({ number: n, ratio, left_out: why }) => {
        const out = why ? "out" : "";
        return `<span class="${out}" title="${escaped(why)}">#${n} ${number(ratio, SHARE * ratio)}</span>`;
      });
      const out = own
        .filter((one) => !counts(one))
        .map((one) => {
          return `▲ #${one.number} ${one.left_out.split(":")[0]}`;
        });
      const text = mean ? number(mean, SHARE * mean) : "–";
      const away = mean ? signed(100 * (mean / agreement.ratio - 1), 1) : "–";
      return `<tr>${named(i, file.name)}<td class="name">${each.join("")}</td><td>${text}</td><td>${away}</td><td class="name bad">${escaped(out.join("; "))}</td></tr>`;
    });
    const words = escaped(`${name}: ${resultWords(agreement, farthest, apart)}`);
    const heads = `<th class="name">Recording</th><th class="name">Touches</th><th>Mean</th><th>From all, %</th><th class="name">Left out</th>`;
    const more = `<span class="right">Next that differs <kbd>N</kbd></span>`;
    return `<h2>${words} ${more}</h2><table><tr>${heads}</tr>${rows.join("")}</table>`;
  }
}

// Touches, mean, spread, and the probability of such a spread by chance.
function numbersOf({ touches, ratio, standard_error: error, spread, probability }) {
  const mean = plusMinus(ratio, error).join(" ");
  const chance = probability < 0.001 ? "&lt; 0.1 %" : `${(100 * probability).toFixed(1)} %`;
  return [grouped(touches), mean, (100 * spread).toFixed(1), chance];
}

function resultWords(agreement, farthest, apart) {
  if (!agreement) return "no touch counts";
  if (agreement.agree || !apart) return agreement.text;
  const percent = Math.abs(100 * apart).toFixed(1);
  const side = apart > 0 ? "above" : "below";
  return `▲ recording ${LETTERS[farthest]} is ${percent} % ${side} the others`;
}

function differs({ agreement }) {
  return agreement?.agree === false;
}

function counts({ left_out: why }) {
  return !why;
}

function meanOf(touches) {
  return touches.reduce((sum, { ratio }) => sum + ratio, 0) / touches.length;
}

function mark(i, x, y, path = PATHS[i]) {
  return `<path fill="var(--c${i + 1})" transform="translate(${x} ${y})" d="${path}"/>`;
}

function named(i, name) {
  const sign = `<svg width="16" height="12" aria-hidden="true">${mark(i, 6, 6)}</svg>`;
  return `<td class="name">${sign}${LETTERS[i]} · ${escaped(name)}</td>`;
}

// Where a distance from the mean is, px.
function place(share, { wide, reach }) {
  return wide / 2 + (Math.max(-reach, Math.min(reach, share)) / reach) * (wide / 2 - 8);
}

// A lane for each recording: its touches, and their mean as a bar. A touch beyond the scale is an arrow at its edge.
function lanesOf(touches, mean, { files, scatter }, size) {
  const { wide, reach } = size;
  const share = (ratio) => ratio / mean - 1;
  const x = (ratio) => place(share(ratio), size);
  const edge = place(-1.96 * scatter, size);
  const high = LANE * files.length + 2;
  const lanes = files.map((_, i) => {
    const own = touches.filter(({ file }) => file === i);
    const y = LANE * (i + 0.5) + 2;
    const bar = own.length ? box(x(meanOf(own)) - 1.5, y - 5, 3, 10, `c${i + 1}`) : "";
    const drawn = own.map(({ ratio }) => {
      const path = Math.abs(share(ratio)) > reach ? ARROWS[share(ratio) > 0 ? 1 : 0] : PATHS[i];
      return mark(i, x(ratio), y, path);
    });
    return drawn.join("") + bar;
  });
  const ground = box(edge, 0, wide - 2 * edge, high, "fband");
  const middle = ruler(wide / 2, 0, wide / 2, high, "past");
  return `<svg width="${wide}" height="${high}" aria-hidden="true">${ground}${middle}${lanes.join("")}</svg>`;
}

function axis(size) {
  const shares = size.wide < 300 ? [-1, 0, 1] : [-1, -0.5, 0, 0.5, 1];
  const marks = shares.map((share) => {
    const anchor = ["start", "middle", "end"][Math.trunc(share) + 1];
    const text = share ? `${signed(100 * share * size.reach, 0)} %` : "0";
    return `<text x="${place(share * size.reach, size)}" y="12" text-anchor="${anchor}">${text}</text>`;
  });
  return `<svg width="${size.wide}" height="16">${marks.join("")}</svg>`;
}
