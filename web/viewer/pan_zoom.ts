/** Panning and zooming a picture of texels by wheel, mouse and touch. */
import type { Changed, State } from "./state";

/** The picture on the canvas, as `Stage` has it. */
interface Picture {
  readonly hasMesh: boolean;
  readonly gizmos: { readonly dragging: boolean };
  fit(): number;
  spread(): { zoom: number; left: number; top: number };
}

/** Wheel and pointers change `state.zoom` and `state.middle`, unless a mesh is shown. `size`: of the picture, texels. */
export function panAndZoom(canvas: HTMLCanvasElement, state: State, size: { width: number; height: number }, picture: Picture, changed: Changed): void {
  const held = new Map<number, [number, number]>();
  const begin = () => {
    if (state.zoom) return;
    state.zoom = picture.fit();
    state.middle = [size.width / 2, size.height / 2];
  };
  const zoomed = (factor: number, x: number, y: number) => {
    begin();
    const { zoom, left, top } = picture.spread();
    const next = Math.min(64, Math.max(0.05, zoom * factor));
    const [u, v] = [(x - left) / zoom, (y - top) / zoom];
    state.zoom = next;
    state.middle = [u - (x - canvas.clientWidth / 2) / next, v - (y - canvas.clientHeight / 2) / next];
    changed();
  };
  canvas.addEventListener(
    "wheel",
    (event) => {
      if (picture.hasMesh) return;
      event.preventDefault();
      zoomed(Math.exp(-event.deltaY / 400), event.offsetX, event.offsetY);
    },
    { passive: false },
  );
  canvas.addEventListener("pointerdown", (event) => {
    if (!picture.hasMesh) held.set(event.pointerId, [event.offsetX, event.offsetY]);
  });
  canvas.addEventListener("pointermove", (event) => {
    const from = held.get(event.pointerId);
    if (!from || picture.hasMesh || picture.gizmos.dragging) return;
    const to: [number, number] = [event.offsetX, event.offsetY];
    const other = [...held].find(([id]) => id !== event.pointerId)?.[1];
    if (other) {
      const apart = (p: [number, number]) => Math.hypot(p[0] - other[0], p[1] - other[1]);
      zoomed(apart(to) / Math.max(1, apart(from)), (to[0] + other[0]) / 2, (to[1] + other[1]) / 2);
    } else if (event.buttons) {
      begin();
      state.middle = [state.middle[0] - (to[0] - from[0]) / state.zoom, state.middle[1] - (to[1] - from[1]) / state.zoom];
      changed();
    }
    held.set(event.pointerId, to);
  });
  for (const end of ["pointerup", "pointercancel", "pointerleave"] as const) canvas.addEventListener(end, (event) => held.delete(event.pointerId));
}
