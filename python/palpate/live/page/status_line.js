// The line: what to know now, in words; answers to commands; what a screen reader says.

import { $, fill, make, put } from "./dom.js";
import { clock } from "./formatting.js";

const GLYPHS = { fault: "✕ ", caution: "▲ ", note: "● ", quiet: "", finished: "✓ " };
const ANSWER_MS = 8000;
const LOUD = ["fault", "caution"];

export class StatusLine {
  down = null; // { title, text } while there is no connection

  update(type, known) {
    if (["state", "hello", "looking"].includes(type)) this.show(known);
    if (type === "state") put("announced", known.state.announce ?? "");
  }

  show(known) {
    const { level, what, title, text, since_s: since, glyph } = this.pick(known);
    if ($("line").dataset.level !== level) $("line").dataset.level = level;
    put($("says").children[0], title ? (glyph ?? GLYPHS[what] ?? GLYPHS[level]) + title : "");
    fill($("says").children[1], text, () => text.split("`").map((part, i) => (i % 2 ? make("code", { textContent: part }) : part)));
    $("says").title = text;
    const { hello, state, looking } = known;
    document.body.classList.toggle("looking", Boolean(looking));
    put($("pause").firstChild, looking ? "Live " : "Pause ");
    put("since", what === "demo" ? `round ${hello.measurement}` : since && what !== "finished" ? `for ${clock(since)}` : "");
    $("understood").hidden = this.down || what !== "slow";
    put("alarm", level === "fault" ? `${title} ${text}` : "");
    const word = this.down ? "No connection" : state.now?.word;
    document.title = [level === "fault" ? `${GLYPHS.fault}${title.replace(/\.$/, "")}` : word, "palpate"].filter(Boolean).join(" · ");
  }

  pick({ hello, state, looking }) {
    const said = state.line ?? { level: "quiet", title: "", text: "" };
    if (this.down) return { level: "fault", ...this.down };
    if (LOUD.includes(said.level) || !looking || hello.kind === "file") return said;
    const origin = hello.origin_s ?? 0;
    const title = `Looking back at ${clock(looking.from_s - origin)} to ${clock(looking.to_s - origin)}.`;
    return { level: "note", glyph: "‖ ", title, text: "Measuring and recording go on: the state below is live. L: back to live." };
  }

  // The answer to a command, beside the line for some seconds.
  answer(text, bad = false) {
    put("answer", text);
    $("answer").dataset.bad = bad ? "yes" : "no";
    put($("files")?.open ? "filesays" : "announced", text);
    clearTimeout(this.waiting);
    if (text) this.waiting = setTimeout(() => this.answer(""), ANSWER_MS);
  }
}
