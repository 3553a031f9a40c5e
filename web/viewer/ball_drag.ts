/** Dragging the moving sphere: in the plane through it that faces the eye, within a box. */
import type { Triple } from "../src";
import type { Box } from "./ball_state";
import { rounded } from "./light_state";
import type { Changed, State } from "./state";

interface View {
  /** Whether a place of the canvas (CSS pixels) shows the sphere. */
  ballAt(x: number, y: number): boolean;
  /** The place under (x, y) of the plane through `through` that faces the eye. */
  onPlane(x: number, y: number, through: Triple): Triple | undefined;
}

export function dragBall(canvas: HTMLElement, view: View, state: State, { least, most }: Box, changed: Changed): void {
  let held: { pointer: number; offset: Triple } | undefined;
  const parent = canvas.parentElement as HTMLElement;
  const place = (event: PointerEvent) => {
    const { left, top } = canvas.getBoundingClientRect();
    return [event.clientX - left, event.clientY - top] as const;
  };
  parent.addEventListener(
    "pointerdown",
    (event) => {
      const { ball } = state;
      if (event.target !== canvas || event.button !== 0 || !ball || !view.ballAt(...place(event))) return;
      const under = view.onPlane(...place(event), ball.position);
      if (!under) return;
      held = { pointer: event.pointerId, offset: ball.position.map((x, k) => x - under[k]) as unknown as Triple };
      canvas.setPointerCapture(event.pointerId);
      event.stopPropagation(); // neither the orbit's nor the handles'
      event.preventDefault();
    },
    { capture: true },
  );
  parent.addEventListener(
    "pointermove",
    (event) => {
      const { ball } = state;
      if (!held || !ball || event.pointerId !== held.pointer) {
        if (!event.buttons) canvas.style.cursor = view.ballAt(...place(event)) ? "grab" : "";
        return;
      }
      event.stopPropagation();
      const under = view.onPlane(...place(event), ball.position);
      const { offset } = held;
      if (under) ball.position = rounded(under.map((x, k) => Math.min(most[k], Math.max(least[k], x + offset[k]))) as unknown as Triple);
      changed({ lights: true });
    },
    { capture: true },
  );
  const release = (event: PointerEvent) => {
    if (held?.pointer !== event.pointerId) return;
    held = undefined;
    event.stopPropagation();
  };
  for (const name of ["pointerup", "pointercancel"] as const) parent.addEventListener(name, release, { capture: true });
}
