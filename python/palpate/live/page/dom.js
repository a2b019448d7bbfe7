// Small helpers for elements. What has not changed is not touched, so that a button stays the one that is pressed.

export const $ = (id) => document.getElementById(id);

export function put(place, text) {
  const element = typeof place === "string" ? $(place) : place;
  if (element.textContent !== String(text)) element.textContent = text;
}

export function make(tag, properties = {}, ...children) {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
}

export function drawn(tag, attributes, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

// Opens a dialog; what is done when it is closed with a value is set by `onclose`.
export function ask(dialog, done = () => {}) {
  dialog.returnValue = "";
  dialog.onclose = () => dialog.returnValue && done(dialog.returnValue);
  dialog.showModal();
}

// In a frame, a browser may forbid storage: then it holds until the page is closed.
export function remembered(name) {
  try {
    return localStorage.getItem(name);
  } catch {
    return null;
  }
}

export function remember(name, value) {
  try {
    localStorage.setItem(name, value);
  } catch {
    // as above
  }
}
