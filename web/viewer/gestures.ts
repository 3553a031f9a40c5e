/** What else is dragged on the page besides lights: the comparison's slider, and files. */
import { element } from "./messages";
import type { Changed, State } from "./state";

/** Let the slider be dragged, or moved by the arrow keys. */
export function dragSplit(state: State, changed: Changed): void {
  const handle = element("split").querySelector("i") as HTMLElement;
  const to = (fraction: number) => {
    state.split = Math.round(1e4 * Math.min(0.98, Math.max(0.02, fraction))) / 1e4;
    changed();
  };
  handle.addEventListener("pointerdown", (event) => {
    handle.setPointerCapture(event.pointerId);
    event.preventDefault();
  });
  handle.addEventListener("pointermove", (event) => {
    if (!handle.hasPointerCapture(event.pointerId)) return;
    const { left, width } = element("stage").getBoundingClientRect();
    to((event.clientX - left) / width);
  });
  handle.addEventListener("keydown", (event) => {
    if (event.key !== "ArrowLeft" && event.key !== "ArrowRight") return;
    to(state.split + (event.key === "ArrowLeft" ? -0.02 : 0.02));
    event.preventDefault();
    event.stopPropagation();
  });
}

/** Hand every file that is dropped on the page to `take`. */
export function dropFiles(take: (file: File) => void): void {
  const over = (on: boolean) => document.body.classList.toggle("dropping", on);
  window.addEventListener("dragover", (event) => {
    event.preventDefault();
    over(true);
  });
  window.addEventListener("dragleave", (event) => {
    if (!event.relatedTarget) over(false);
  });
  window.addEventListener("drop", (event) => {
    event.preventDefault();
    over(false);
    for (const file of event.dataTransfer?.files ?? []) take(file);
  });
}

/** Ask for one file of the kinds `accept`. */
export function pickFile(accept: string, take: (file: File) => void): void {
  const input = document.createElement("input");
  input.type = "file";
  input.accept = accept;
  input.onchange = () => {
    if (input.files?.[0]) take(input.files[0]);
  };
  input.click();
}

/** A double click, or two taps at once, at a place of an element, CSS pixels. */
export function onDoubleTap(element: HTMLElement, act: (x: number, y: number) => void): void {
  let tapped = 0;
  element.addEventListener("pointerup", (event) => {
    if (event.pointerType !== "mouse" && event.timeStamp - tapped < 300) act(event.offsetX, event.offsetY);
    tapped = event.timeStamp;
  });
  element.addEventListener("dblclick", (event) => act(event.offsetX, event.offsetY));
}
