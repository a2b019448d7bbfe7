// Marks, notes and judgements. A mark is stamped when its key is pressed; its text comes in the field that appears, later, or never.

import { $, fill, make, put } from "./dom.js";
import { clock } from "./formatting.js";

const OPEN_MS = 8000; // an empty field goes by itself
const LET_GO_MS = 4000; // an empty field gives the keys back

export class Marks {
  constructor(known, say) {
    Object.assign(this, { known, say, timers: [] });
    $("mark").onclick = ({ pointerType }) => {
      this.typing = pointerType !== "touch"; // a finger would only get a keyboard over the page
      say({ do: "mark" });
    };
    $("unmark").onclick = () => this.close();
    $("marking").onsubmit = (event) => this.close(event.preventDefault());
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
    fill($("marks"), [all, origin], () => all.map(({ t_s: t, text, id }) => {
      const open = () => this.open(id, text, true), words = id === undefined || hello.kind === "file"
        ? make("span", { textContent: text || "mark" })
        : make("button", { type: "button", className: "plain", textContent: text || "mark: add a text", onclick: open });
      return make("li", {}, make("time", { textContent: clock(t - origin) }), words);
    }));
  }

  // The field is in the line's row; a fault or a caution has that row, and the field goes on in the list of marks.
  move() {
    const form = $("marking"), place = ["fault", "caution"].includes($("line").dataset.level) ? $("markplace") : $("line");
    if (form.parentElement === place) return;
    const typing = document.activeElement === $("marktext");
    place.append(form);
    if (typing) $("marktext").focus();
  }

  // For the text of a mark; without one the field goes by itself.
  open(id, text, focus = this.typing) {
    this.stop();
    const at = this.known.events.marks.find((mark) => mark.id === id)?.t_s;
    put($("marking").firstChild, at === undefined ? "Mark is stamped." : `Mark at ${clock(at - (this.known.hello.origin_s ?? 0))}`);
    if (!$("marking").hidden) this.close();
    this.id = id;
    $("marktext").value = this.before = text;
    $("marking").hidden = false;
    if (focus) $("marktext").focus();
    if (!text) this.timers = [setTimeout(() => $("marktext").blur(), LET_GO_MS), setTimeout(() => this.close(), OPEN_MS)];
  }

  stop() {
    this.timers.forEach(clearTimeout);
  }

  // What was typed is sent: nothing of it is lost, and it can be changed later.
  close() {
    const text = $("marktext").value.trim();
    if (!$("marking").hidden && text !== this.before && !this.say({ do: "mark text", id: this.id, text })) return;
    this.stop();
    $("marktext").blur();
    $("marking").hidden = true;
  }

  note(event) {
    event.preventDefault();
    const text = $("note").value.trim();
    if (text && this.say({ do: "note", text })) $("note").value = "";
    $("note").blur();
  }
}
