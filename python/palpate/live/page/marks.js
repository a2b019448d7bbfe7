// Marks, notes and judgements. A mark is stamped when its key is pressed; its text comes in the field that appears, later, or never.

import { $, fill, make, put } from "./dom.js";
import { clock } from "./formatting.js";

const OPEN_MS = 8000; // an empty field goes by itself
const LET_GO_MS = 4000; // an empty field gives the keys back

export class Marks {
  constructor(known, send) {
    Object.assign(this, { known, send });
    this.timers = [];
    $("mark").onclick = ({ pointerType }) => {
      this.typing = pointerType !== "touch"; // a finger would only get a keyboard over the page
      send({ do: "mark" });
    };
    $("unmark").onclick = () => this.close();
    $("marking").onsubmit = (event) => {
      event.preventDefault();
      this.close();
    };
    $("marktext").oninput = () => this.stop();
    $("noting").onsubmit = (event) => this.note(event);
  }

  update(type, known) {
    this.move();
    if (["events", "session", "hello"].includes(type)) this.show(known);
  }

  show({ events, session, hello }) {
    const origin = hello.origin_s ?? 0;
    const judged = events.judgements.map(({ t_s, text }) => ({ t_s, text: `▲ ${text}` }));
    const all = [...events.marks, ...session.notes, ...judged].toSorted((a, b) => b.t_s - a.t_s);
    const fixed = hello.kind === "file";
    fill($("marks"), [all, origin, fixed], () =>
      all.map((one) => {
        const time = make("time", { textContent: clock(one.t_s - origin) });
        return make("li", {}, time, this.words(one, fixed));
      }),
    );
  }

  // The text of a mark can be changed, but not in a file.
  words({ id, text }, fixed) {
    if (id === undefined || fixed) return make("span", { textContent: text || "mark" });
    const button = make("button", { type: "button", className: "plain" });
    button.textContent = text || "mark: add a text";
    button.onclick = () => this.open(id, text, true);
    return button;
  }

  // The field is in the line's row; a fault or a caution has that row, and the field goes on in the list of marks.
  move() {
    const form = $("marking");
    const loud = ["fault", "caution"].includes($("line").dataset.level);
    const place = loud ? $("markplace") : $("line");
    if (form.parentElement === place) return;
    const typing = document.activeElement === $("marktext");
    place.append(form);
    if (typing) $("marktext").focus();
  }

  // For the text of a mark; without one the field goes by itself.
  open(id, text, focus = this.typing) {
    this.stop();
    const at = this.known.events.marks.find((mark) => mark.id === id)?.t_s;
    const origin = this.known.hello.origin_s ?? 0;
    const words = at === undefined ? "Mark is stamped." : `Mark at ${clock(at - origin)}`;
    put($("marking").firstChild, words);
    if (!$("marking").hidden) this.close();
    this.id = id;
    this.before = text;
    $("marktext").value = text;
    $("marking").hidden = false;
    if (focus) $("marktext").focus();
    if (text) return;
    this.timers = [
      setTimeout(() => $("marktext").blur(), LET_GO_MS),
      setTimeout(() => this.close(), OPEN_MS),
    ];
  }

  stop() {
    this.timers.forEach(clearTimeout);
  }

  // What was typed is sent: nothing of it is lost, and it can be changed later.
  close() {
    const text = $("marktext").value.trim();
    const changed = !$("marking").hidden && text !== this.before;
    if (changed && !this.send({ do: "mark text", id: this.id, text })) return;
    this.stop();
    $("marktext").blur();
    $("marking").hidden = true;
  }

  note(event) {
    event.preventDefault();
    const text = $("note").value.trim();
    if (text && this.send({ do: "note", text })) $("note").value = "";
    $("note").blur();
  }
}
