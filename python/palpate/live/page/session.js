// The session: how far each specimen is, the next one, and the last touch: left out or kept.

import { $, aligned, ask, drawn, make, put } from "./dom.js";
import { places } from "./formatting.js";

const REACH = 0.08; // of the mean, at the edge of the small plot
const WIDE = 124, HIGH = 18;

export class Session {
  constructor(say) {
    Object.assign(this, { say, known: null });
    $("discard").onclick = () => this.discard();
    $("onemore").onclick = () => say({ do: "more" });
    $("specimens").addEventListener("click", (event) => {
      const name = event.target.closest("button")?.textContent;
      if (name !== undefined) say({ do: "specimen", name });
    });
  }

  tell(type, known) {
    this.known = known;
    if (type === "session" || type === "hello") this.show(known);
  }

  show({ session, hello }) {
    const { title, specimens, count, last } = session, file = hello.kind === "file";
    put("sessiontitle", title ?? "");
    put("sessioncount", count?.of ? `${count.kept} of ${count.of} touches` : "");
    const longest = Math.max(0, ...specimens.map(({ modulus }) => places(modulus ?? "")));
    const scatter = hello.scatter ?? null;
    $("specimens").replaceChildren(...specimens.map((one) => row(one, session.next?.name, longest, scatter, file)));
    $("specimens").parentElement.hidden = !specimens.length;
    $("discard").disabled = !last;
    $("onemore").hidden = file;
    $("onemore").disabled = !session.next;
    put("discard", !last ? "Discard" : !last.kept ? `Keep ${last.touch} after all` : file || !session.next ? `Leave ${last.touch} out` : `Discard ${last.touch}, repeat it`);
  }

  discard() {
    const last = this.known?.session.last;
    if (last) this.say({ do: last.kept ? "discard" : "keep", touch: last.touch });
  }

  // The specimen behind the next one; behind the last one the first.
  next() {
    const { specimens, next } = this.known.session;
    if (!specimens.length) return;
    const at = specimens.findIndex(({ name }) => name === next?.name);
    this.say({ do: "specimen", name: specimens[(at + 1) % specimens.length].name });
  }
}

function row({ name, modulus, kept, of, deviations }, here, longest, scatter, file) {
  const plot = drawn("svg", { viewBox: `0 0 ${WIDE} ${HIGH}`, role: "img", "aria-label": described(name, deviations) }, ...dots(deviations, scatter));
  const button = make("button", { type: "button", className: "plain", textContent: name, disabled: file, ariaCurrent: name === here ? "true" : null });
  return make("tr", { className: name === here ? "here" : "" },
    make("td", { className: "name" }, button), make("td", {}, modulus ? aligned(modulus, longest) : "?"),
    make("td", { className: "name" }, plot), make("td", { textContent: `${kept >= of ? "✓ " : ""}${kept}/${of}` }));
}

function dots(deviations, scatter) {
  const x = (d) => WIDE / 2 + (Math.max(-REACH, Math.min(REACH, d)) / REACH) * (WIDE / 2 - 6);
  const known = deviations.filter(({ deviation }) => deviation !== null).toSorted((a, b) => b.kept - a.kept);
  if (!known.length) return [];
  const band = scatter ? [drawn("rect", { x: x(-scatter), y: 2, width: x(scatter) - x(-scatter), height: HIGH - 4, class: "fband" })] : [];
  const middle = drawn("line", { x1: WIDE / 2, x2: WIDE / 2, y1: 1, y2: HIGH - 1, class: "grid0" });
  return [...band, middle, ...known.map(({ deviation, kept }) => (kept
    ? drawn("circle", { cx: x(deviation), cy: HIGH / 2, r: 3, class: "dot" })
    : drawn("text", { x: x(deviation), y: HIGH / 2 + 4, class: "leftout", "text-anchor": "middle" }, "×")))];
}

function described(name, deviations) {
  const known = deviations.filter(({ deviation }) => deviation !== null);
  return known.length ? `${name}: ${known.map(({ touch, deviation, kept }) => `touch ${touch} ${(100 * deviation).toFixed(1)} %${kept ? "" : ", left out"}`).join("; ")}` : `${name}: no touch`;
}

// The dialog for the list of specimens: typed, pasted, or from a file.
const LONGEST = 4000; // characters

export class Plan {
  constructor(say, answer) {
    this.say = say;
    $("openplan").onclick = () => this.open();
    $("listfile").onchange = () => this.load(answer);
    $("list").oninput = () => this.judge();
    $("plan").firstElementChild.onsubmit = (event) => this.send(event);
  }

  tell(type, known) {
    this.session = known.session;
  }

  open() {
    const { title, operator, wanted, specimens } = this.session;
    $("title").value = title ?? "";
    $("operator").value = operator ?? "";
    $("wanted").value = wanted || 4;
    $("list").value = specimens.map(({ name, modulus }) => (modulus ? `${name}; ${modulus}` : name)).join("\n");
    $("listfile").value = "";
    this.judge();
    ask($("plan"));
  }

  async load(answer) {
    const [file] = $("listfile").files;
    if (!file) return;
    if (file.size > LONGEST) answer(`${file.name}: ${file.size} bytes, allowed: ${LONGEST}; one specimen a line`, true);
    else $("list").value = await file.text();
    this.judge();
  }

  // A list that is too long is not cut without a word: the browser says what is wrong, and keeps the dialog open.
  judge() {
    this.show("");
    const { length } = $("list").value;
    $("list").setCustomValidity(length > LONGEST ? `${length} characters, allowed: ${LONGEST}. Shorten the names, or use two sessions.` : "");
  }

  // The server's answer: it has the list, or each line that is wrong, with its reason.
  answered(message, taken = false) {
    if (taken) $("plan").close();
    else if ($("plan").open) this.show(message);
    return $("plan").open;
  }

  show(reasons) {
    const lines = [...reasons.matchAll(/^line (\d+)/gm)].map(([, number]) => Number(number) - 1), { value } = $("list");
    put("listwrong", reasons && `▲ ${reasons}\nNothing is lost: correct it, and press again.`);
    $("list").ariaInvalid = String(lines.length > 0);
    $("list").style.backgroundImage = lines.map(() => "linear-gradient(var(--wrong) 0 0)").join();
    $("list").style.backgroundPosition = lines.map((line) => `0 calc(0.27rem + ${line}lh)`).join();
    if (!lines.length) return;
    $("list").focus();
    $("list").selectionStart = $("list").selectionEnd = value.split("\n").slice(0, lines[0]).join("\n").length + (lines[0] > 0);
  }

  send(event) {
    if (!event.submitter?.value) return;
    event.preventDefault();
    $("list").value = $("list").value.trim(); // as the server counts the lines
    const sent = this.say({ do: "plan", text: $("list").value, wanted: Math.max(1, Math.min(99, Math.round($("wanted").valueAsNumber) || 4)), title: $("title").value, operator: $("operator").value });
    if (!sent) this.show("Not connected: the list was not sent.");
  }
}
