// The session: how far each specimen is, the next one, and the last touch: left out or kept.

import { box, dot, escaped, label, ruler } from "./charts/svg.js";
import { $, aligned, ask, make, put } from "./dom.js";
import { inUnit, places, settings } from "./formatting.js";
import { storage } from "./preferences.js";

const REACH = 0.08; // of the mean, at the edge of the small plot
const WIDE = 124, HIGH = 18;

export class Session {
  constructor(known, say) {
    Object.assign(this, { known, say });
    $("discard").onclick = () => {
      const { kept, touch } = this.known.session.last;
      say({ do: kept ? "discard" : "keep", touch });
    };
    $("unknown").onclick = () => this.next();
  }

  update(type, known) {
    if (type === "session" || type === "hello") this.show(known);
    if (type === "session" || type === "state") this.showEnd(known);
  }

  // What can be done when all specimens are.
  showEnd({ session, state }) {
    const on = Boolean(session.done) && state.now?.word === "Done";
    document.body.classList.toggle("finished", on);
    $("ending").hidden = !on;
    $("endfile").disabled = !state.recording;
    const made = state.files?.findLast(({ kind }) => kind === "report");
    put("openreport", made ? "Open report" : "Make report");
    $("openreport").onclick = () => (made ? open(`recording/${encodeURIComponent(made.name)}`) : $("report").click());
  }

  show({ session, hello }) {
    const { title, specimens, count, last } = session, file = hello.kind === "file";
    put("sessiontitle", title ?? "");
    put("sessioncount", count?.of ? `${count.kept} of ${count.of} touches` : "");
    const longest = Math.max(0, ...specimens.map(({ modulus }) => places(inUnit(modulus ?? ""))));
    $("specimens").replaceChildren(...specimens.map((one) => this.row(one, longest)));
    const list = $("specimens").closest(".list"), here = $("specimens").querySelector(".here") ?? $("specimens").lastElementChild;
    list.hidden = !specimens.length;
    if (session.next?.name !== this.here) list.scrollTop = (here?.offsetTop ?? 0) - list.clientHeight / 2;
    this.here = session.next?.name;
    $("discard").disabled = !last;
    $("onemore").hidden = file;
    $("onemore").disabled = !specimens.length;
    put("discard", !last ? "Discard" : !last.kept ? `Keep ${last.touch} after all` : file || !session.next ? `Leave ${last.touch} out` : `Discard ${last.touch}, repeat it`);
    put("leave", !last ? "Leave out" : last.kept ? `Leave ${last.touch} out` : `Keep ${last.touch}`);
    $("leave").disabled = !last;
  }

  // The specimen behind the next one; behind the last one the first. When all are done: none, for other objects.
  next() {
    const { specimens, next, done } = this.known.session;
    if (!specimens.length) return;
    if (done) {
      if (this.known.calibration.on) this.say({ do: "calibrating", on: false });
      return void this.say({ do: "specimen", name: "" });
    }
    const at = specimens.findIndex(({ name }) => name === next?.name);
    this.say({ do: "specimen", name: specimens[(at + 1) % specimens.length].name });
  }

  row({ name, modulus, kept, of, deviations }, longest) {
    const { session, hello } = this.known, here = session.next?.name === name, known = deviations.filter(({ deviation }) => deviation !== null);
    const said = known.map(({ touch, deviation, kept: is }) => `touch ${touch} ${(100 * deviation).toFixed(1)} %${is ? "" : ", left out"}`).join("; ") || "no touch";
    const plot = `<svg viewBox="0 0 ${WIDE} ${HIGH}" role="img" aria-label="${escaped(`${name}: ${said}`)}">${known.length ? dots(known, hello.scatter) : ""}</svg>`;
    const onclick = () => this.say({ do: "specimen", name });
    const button = make("button", { type: "button", className: "plain", textContent: name, disabled: hello.kind === "file", ariaCurrent: here ? "true" : null, onclick });
    return make("tr", { className: here ? "here" : "" },
      make("td", { className: "name" }, button), make("td", {}, modulus ? aligned(inUnit(modulus), longest) : "?"),
      make("td", { className: "name", innerHTML: plot }), make("td", { textContent: `${kept >= of ? "✓ " : ""}${kept}/${of}` }));
  }
}

function dots(known, scatter) {
  const x = (d) => WIDE / 2 + (Math.max(-REACH, Math.min(REACH, d)) / REACH) * (WIDE / 2 - 6);
  const each = ({ deviation: d, kept }) => (kept ? dot(x(d), HIGH / 2, 3, false, "hard") : label(x(d), HIGH / 2 + 4, "×", "leftout", "middle"));
  const band = scatter ? box(x(-scatter), 2, x(scatter) - x(-scatter), HIGH - 4, "fband") : "";
  return band + ruler(WIDE / 2, 1, WIDE / 2, HIGH - 1, "past") + known.toSorted((a, b) => b.kept - a.kept).map(each).join("");
}

// What a session gave, as the large numbers show it.
export function outcome({ session: { done }, calibration, hello }) {
  const share = `± ${(100 * done.scatter).toFixed(1)} %`, before = hello.assumed ? `was ${Number((100 * hello.assumed).toPrecision(2))} %, assumed` : "by the calibration";
  const inside = { secondname: "Inside their intervals", number2: `${done.inside} of ${done.of}`, range2: calibration.saved ? "fitted to them: no test" : "" };
  return { mainname: "This probe and this hand, from touch to touch (k = 1)", number: share, unit: "", pm: "", range: done.source === "assumed" ? "assumed: too few touches were repeated" : before, ...(done.of ? inside : {}) };
}

// The dialog for the list of specimens: typed, pasted, or from a file. What is typed stays until it is used, also when the
// page is loaded again.
const TYPED = ["title", "wanted", "list"];
const READ_MS = 200;

export class Plan {
  memory = storage();

  constructor(known, say) {
    Object.assign(this, { known, say });
    $("openplan").onclick = () => {
      ask($("plan"));
      this.fill();
    };
    $("listfile").onchange = async () => {
      $("list").value = await $("listfile").files[0].text();
      this.keep();
    };
    $("list").onscroll = () => ($("listread").scrollTop = $("list").scrollTop);
    $("plan").firstElementChild.oninput = () => this.keep();
    $("plan").firstElementChild.onsubmit = (event) => this.send(event);
    $("undraft").onclick = () => this.fill(delete this.memory.draft);
  }

  fill() {
    const { title, wanted, specimens } = this.known.session, lines = specimens.map((one) => (one.modulus ? `${one.name}; ${known(one, "; ")}` : one.name));
    const { draft } = this.memory, values = draft ? JSON.parse(draft) : [title ?? "", wanted || 4, lines.join("\n")];
    TYPED.forEach((name, i) => ($(name).value = values[i]));
    $("listfile").value = "";
    $("undraft").hidden = !draft;
    this.judge(draft ? "Typed before, and not in use yet." : "");
  }

  keep() {
    this.memory.draft = JSON.stringify(TYPED.map((name) => $(name).value));
    $("undraft").hidden = false;
    this.judge();
  }

  // Asks the server how it reads each line.
  judge(said = "") {
    put("listwrong", said);
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => this.say({ do: "read list", text: $("list").value, unit: settings.unit }), READ_MS);
  }

  read(lines) {
    put("listread", lines.map((one) => (!one ? "" : one.wrong ? "not understood" : one.modulus === null ? "not known" : known(one, " ± "))).join("\n"));
    put(document.querySelector("#plan button.strong"), `Use these ${lines.filter(Boolean).length || ""}`);
    const wrong = lines.flatMap((one, i) => (one?.wrong ? [i] : []));
    $("list").ariaInvalid = String(wrong.length > 0);
    $("list").style.backgroundImage = wrong.map(() => "linear-gradient(var(--wrong) 0 0)").join();
    $("list").style.backgroundPosition = wrong.map((line) => `0 calc(0.27rem + ${line}lh)`).join();
  }

  // The server's answer: it has the list, or each line that is wrong, with its reason.
  answered(message, taken = false) {
    if (taken) $("plan").close(delete this.memory.draft);
    else if ($("plan").open) this.refuse(message);
    return $("plan").open;
  }

  refuse(reasons) {
    const first = reasons.match(/^line (\d+)/)?.[1];
    put("listwrong", `▲ ${reasons}\nNothing is lost: correct it, and press again.`);
    $("list").focus();
    if (first) $("list").selectionStart = $("list").selectionEnd = `\n${$("list").value}`.split("\n", first).join("\n").length;
  }

  send(event) {
    if (!event.submitter?.value) return;
    event.preventDefault();
    const sent = this.say({ do: "plan", text: $("list").value, unit: settings.unit, wanted: Math.max(1, Math.min(99, Math.round($("wanted").valueAsNumber) || 4)), title: $("title").value, ...(settings.operator && { operator: settings.operator }) });
    if (!sent) this.refuse("Not connected: the list was not sent.");
  }
}

// A modulus with its unit, and its standard uncertainty behind a sign.
function known({ modulus, uncertainty }, sign) {
  const text = `${inUnit(modulus)} ${settings.unit}`;
  return uncertainty === null ? text : `${text}${sign}${Number((100 * uncertainty).toPrecision(6))} %`;
}
