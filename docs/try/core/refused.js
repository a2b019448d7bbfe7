// What a visitor is told where something is not read: what, the value, what is allowed, what to do.

export class Refused extends Error {}

const MOST = 80;

export function quoted(value) {
  const text = typeof value === "string" ? `'${value}'` : JSON.stringify(value) ?? String(value);
  return text.length > MOST ? `${text.slice(0, MOST)}... (${text.length} characters)` : text;
}

// Refuses unless it holds.
export function require(holds, text) {
  if (!holds) throw new Refused(text);
}
