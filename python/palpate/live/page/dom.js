// Small helpers for elements. What has not changed is not touched, so that a button stays the one that is pressed.

export const $ = (id) => document.getElementById(id);

export function put(place, text) {
  const element = typeof place === "string" ? $(place) : place;
  if (element.textContent !== String(text)) element.textContent = text;
}

// Fills a place anew if `of`, what it shows, has changed.
export function fill(place, of, children) {
  const now = JSON.stringify(of);
  if (place.filled === now) return;
  place.filled = now;
  place.replaceChildren(...children());
}

export function make(tag, properties = {}, ...children) {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
}

// Makes these elements the children of a place. Those that stay, in the same order, are not touched, so that the focus stays.
export function arrange(place, children) {
  const stay = new Set(children);
  for (const old of [...place.children]) {
    if (!stay.has(old)) old.remove();
  }
  children.forEach((child, i) => {
    if (place.children[i] !== child) place.insertBefore(child, place.children[i] ?? null);
  });
}

// Opens a dialog; what is done when it is closed with a value is set by `onclose`.
export function ask(dialog, done = () => {}) {
  dialog.returnValue = "";
  dialog.onclose = () => {
    if (dialog.returnValue) done(dialog.returnValue);
  };
  dialog.showModal();
}

// A number whose point stands under the point above it: its fraction is as wide as the longest of its column.
export function aligned(text, longest) {
  const [whole, part] = String(text).split(".");
  const width = longest ? longest + 0.45 : 0;
  const fraction = make("i", { textContent: part === undefined ? "" : `.${part}`, style: `min-width: ${width}ch` });
  return make("span", { className: "pt" }, whole, fraction);
}
