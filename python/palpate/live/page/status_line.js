// The status line: what to know now, in words; answers to commands; what a screen reader reads.

import { $, fill, make, put } from "./dom.js";
import { clock, sentenceInUnit, settings } from "./formatting.js";

const GLYPHS = { fault: "✕ ", caution: "▲ ", note: "● ", quiet: "", finished: "✓ " };
const ANSWER_MS = 8000;
const LOUD = ["fault", "caution"];
const SHOWN_BY = ["state", "hello", "looking"];
const NOTHING = { level: "quiet", title: "", text: "" };

export class StatusLine {
  down = null; // { title, text } while there is no connection

  update(type, known) {
    if (SHOWN_BY.includes(type)) this.show(known);
    if (type === "state") put("announced", known.state.announce ?? "");
  }

  show(known) {
    const { looking } = known;
    const { level, what, title, text, since_s: since, glyph } = this.pick(known);
    const sign = glyph ?? GLYPHS[what] ?? GLYPHS[level];
    if ($("line").dataset.level !== level) $("line").dataset.level = level;
    put($("says").children[0], title ? sign + title : "");
    fill($("says").children[1], [text, settings.unit], () => withCode(sentenceInUnit(text)));
    $("says").title = text;
    document.body.classList.toggle("looking", Boolean(looking));
    put($("pause").firstChild, looking ? "Live " : "Pause ");
    put("since", since && what !== "finished" ? `for ${clock(since)}` : "");
    $("understood").hidden = Boolean(this.down) || what !== "slow";
    put("alarm", level === "fault" ? `${title} ${text}` : "");
    document.title = this.titleOf(known, level, title);
  }

  titleOf({ state }, level, title) {
    let word = state.now?.word;
    if (this.down) word = "No connection";
    if (level === "fault") word = `${GLYPHS.fault}${title.replace(/\.$/, "")}`;
    return word ? `${word} · palpate` : "palpate";
  }

  // What is wrong comes first; then that the charts look back.
  pick({ hello, state, looking }) {
    const line = state.line ?? NOTHING;
    if (this.down) return { level: "fault", ...this.down };
    if (LOUD.includes(line.level) || !looking || hello.kind === "file") return line;
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

// What is between two ` is a command.
function withCode(text) {
  return text.split("`").map((part, i) => (i % 2 ? make("code", { textContent: part }) : part));
}
