// The specimens in the bar: done, now, next. What has no room is counted.

import { $, fill, make } from "../dom.js";

export class Pills {
  constructor(send) {
    this.send = send;
    addEventListener("resize", () => this.fit());
  }

  update(type, { session, hello }) {
    if (type === "depth") this.fit();
    if (type !== "session" && type !== "hello") return;
    const file = hello.kind === "file";
    const shown = session.specimens.map(({ name, kept, of }) => ({ name, done: kept >= of, here: session.next?.name === name }));
    fill($("pills"), [shown, file], () => shown.map((one) => make("li", {}, this.pill(one, file))));
    this.fit();
  }

  pill({ name, done, here }, file) {
    return make("button", {
      type: "button",
      className: done ? "done" : "",
      textContent: `${done ? "✓ " : ""}${name}`,
      ariaCurrent: here ? "true" : null,
      disabled: file,
      onclick: () => this.send({ do: "specimen", name }),
    });
  }

  // Those that are done go first, from the left; then those that come last.
  fit() {
    const list = $("pills");
    const pills = [...list.querySelectorAll("li:not(.rest)")];
    for (const rest of list.querySelectorAll(".rest")) rest.remove();
    for (const pill of pills) pill.hidden = false;
    const before = make("li", { className: "rest" });
    const after = make("li", { className: "rest" });
    const here = Math.max(0, pills.findIndex((pill) => pill.firstChild.ariaCurrent === "true"));
    let first = 0;
    let last = pills.length;
    while (list.scrollWidth > list.clientWidth && last - first > 1) {
      if (first < here) {
        pills[first].hidden = true;
        first += 1;
        before.textContent = `${first} …`;
        list.prepend(before);
      } else {
        last -= 1;
        pills[last].hidden = true;
        after.textContent = `+${pills.length - last}`;
        list.append(after);
      }
    }
    // Not even one has room: the object below says its name.
    if (list.scrollWidth > list.clientWidth) {
      for (const pill of list.children) pill.hidden = true;
    }
  }
}
