// The dialog for the list of specimens: typed, pasted, or from a file. What is typed stays until it is used, also when the page
// is loaded again.

import { $, ask, put } from "./dom.js";
import { inUnit, settings } from "./formatting.js";
import { storage } from "./preferences.js";

const TYPED = ["title", "wanted", "list"];
const READ_MS = 200;
const MOST_TOUCHES = 99;
const USUAL_TOUCHES = 4;

export class SpecimenList {
  memory = storage();

  constructor(known, send) {
    this.known = known;
    this.send = send;
    $("openplan").onclick = () => {
      ask($("plan"));
      this.fill();
    };
    $("listfile").onchange = async () => {
      $("list").value = await $("listfile").files[0].text();
      this.keep();
    };
    $("list").onscroll = () => {
      $("listread").scrollTop = $("list").scrollTop;
    };
    $("plan").firstElementChild.oninput = () => this.keep();
    $("plan").firstElementChild.onsubmit = (event) => this.use(event);
    $("undraft").onclick = () => {
      delete this.memory.draft;
      this.fill();
    };
  }

  fill() {
    const { title, wanted, specimens } = this.known.session;
    const lines = specimens.map((one) => (one.modulus ? `${one.name}; ${known(one, "; ")}` : one.name));
    const { draft } = this.memory;
    const values = draft ? JSON.parse(draft) : [title ?? "", wanted || USUAL_TOUCHES, lines.join("\n")];
    TYPED.forEach((name, i) => {
      $(name).value = values[i];
    });
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
  judge(words = "") {
    put("listwrong", words);
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => this.send({ do: "read list", text: $("list").value, unit: settings.unit }), READ_MS);
  }

  // The server's answer: how it reads each line.
  read(lines) {
    put("listread", lines.map(readWords).join("\n"));
    put(document.querySelector("#plan button.strong"), `Use these ${lines.filter(Boolean).length || ""}`);
    const wrong = [];
    lines.forEach((one, i) => {
      if (one?.wrong) wrong.push(i);
    });
    $("list").ariaInvalid = String(wrong.length > 0);
    $("list").style.backgroundImage = wrong.map(() => "linear-gradient(var(--wrong) 0 0)").join();
    $("list").style.backgroundPosition = wrong.map((line) => `0 calc(0.27rem + ${line}lh)`).join();
  }

  // The server's answer: it has the list, or each line that is wrong, with its reason. Whether the dialog is open still.
  answered(message, taken = false) {
    if (taken) {
      delete this.memory.draft;
      $("plan").close();
    } else if ($("plan").open) {
      this.refuse(message);
    }
    return $("plan").open;
  }

  refuse(reasons) {
    const first = reasons.match(/^line (\d+)/)?.[1];
    put("listwrong", `▲ ${reasons}\nNothing is lost: correct it, and press again.`);
    $("list").focus();
    if (!first) return;
    const before = `\n${$("list").value}`.split("\n", first).join("\n").length;
    $("list").setSelectionRange(before, before);
  }

  use(event) {
    if (!event.submitter?.value) return;
    event.preventDefault();
    const wanted = Math.round($("wanted").valueAsNumber) || USUAL_TOUCHES;
    const message = {
      do: "plan",
      text: $("list").value,
      unit: settings.unit,
      wanted: Math.max(1, Math.min(MOST_TOUCHES, wanted)),
      title: $("title").value,
    };
    if (settings.operator) message.operator = settings.operator;
    if (!this.send(message)) this.refuse("Not connected: the list was not sent.");
  }
}

function readWords(one) {
  if (!one) return "";
  if (one.wrong) return "not understood";
  return one.modulus === null ? "not known" : known(one, " ± ");
}

// A modulus with its unit, and its standard uncertainty behind a sign.
function known({ modulus, uncertainty }, sign) {
  const text = `${inUnit(modulus)} ${settings.unit}`;
  if (uncertainty === null) return text;
  return `${text}${sign}${Number((100 * uncertainty).toPrecision(6))} %`;
}
