// Files that are dropped or chosen, and a sentence over the page.

import { $, put } from "./page/dom.js";

const MOST_BYTES = 1e9;

export class Dropping {
  // open(files): gets what was dropped or chosen
  constructor(open) {
    this.open = open;
    $("open").onclick = () => $("files").click();
    $("files").onchange = () => {
      this.take([...$("files").files]);
      $("files").value = ""; // the same file may be chosen again
    };
    let inside = 0; // each element that the pointer enters or leaves is told
    addEventListener("dragenter", () => this.hint(++inside));
    addEventListener("dragleave", () => this.hint((inside = Math.max(0, inside - 1))));
    addEventListener("dragover", (event) => event.preventDefault());
    addEventListener("drop", (event) => {
      event.preventDefault();
      this.hint((inside = 0));
      this.take([...(event.dataTransfer?.files ?? [])]);
    });
  }

  hint(inside) {
    $("dropping").hidden = !inside;
  }

  take(files) {
    const size = files.reduce((sum, file) => sum + file.size, 0);
    if (!files.length) return told("Nothing to open", "What was dropped is no file. Drop run.csv of palpate, with its run.json if there is one.");
    if (size > MOST_BYTES) return told("Too large for this page", `${(size / 1e6).toFixed(0)} MB, at most ${MOST_BYTES / 1e6} MB are read here. palpate live FILE reads it.`);
    return this.open(files);
  }
}

// A sentence that needs room, until it is closed.
export function told(title, text) {
  put("saidtitle", title);
  put("saidtext", text);
  if (!$("said").open) $("said").showModal();
}
