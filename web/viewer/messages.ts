/** The page's elements and small buttons, and its one-line messages. */
const TOAST = 8000; // milliseconds

export const element = <E extends HTMLElement>(id: string) => document.getElementById(id) as E;

/** A button of a row of them. */
export function chip(text: string, act: () => void): HTMLButtonElement {
  const made = document.createElement("button");
  made.className = "chip";
  made.textContent = text;
  made.onclick = act;
  return made;
}

const hints = new Map<string, string | undefined>();

/** Say `line`, of a `subject` about which nothing was to be said before. */
export function hintOnce(subject: string, line: string | undefined): void {
  if (line && !hints.get(subject)) say(line, "hint");
  hints.set(subject, line);
}

export function say(message: string, kind: "toast" | "hint" = "toast"): void {
  const place = element(kind);
  place.textContent = message;
  place.hidden = false;
  clearTimeout(Number(place.dataset.timer));
  place.dataset.timer = String(setTimeout(() => (place.hidden = true), TOAST));
}

export const lineOf = (error: unknown) => (error instanceof Error ? error.message : String(error)).replaceAll(/\s+/g, " ");
