/** Files that the page saves: a PNG, FRAMES.json for `srbf relight --lights`, and a script for Blender. */
import { encode } from "fast-png";
import { blenderRig } from "./blender_rig";
import { aim, type LightState, linearColor, shiningOf, sides } from "./light_state";

/** RGBA where anything is transparent, RGB otherwise. */
export function savePng(name: string, image: { width: number; height: number; data: Uint8Array }): void {
  const { width, height, data: rgba } = image;
  const channels = rgba.some((byte, i) => i % 4 === 3 && byte < 255) ? 4 : 3;
  const data = channels === 4 ? rgba : rgba.filter((_, i) => i % 4 !== 3);
  download(name, new Blob([encode({ width, height, channels, data }) as BlobPart], { type: "image/png" }));
}

export function saveFrames(name: string, frames: readonly (readonly LightState[])[]): void {
  const json = { frames: frames.map((lights) => ({ lights: shiningOf(lights).map(entry) })) };
  download(name, new Blob([`${JSON.stringify(json, undefined, 1)}\n`], { type: "application/json" }));
}

/** A script that makes the lights in Blender. */
export function saveRig(name: string, lights: readonly LightState[]): void {
  download(name, new Blob([blenderRig(lights)], { type: "text/x-python" }));
}

/** A light as srbf/schemas/frames.schema.json has it; an environment's file must lie beside FRAMES.json. */
function entry(light: LightState): Record<string, unknown> {
  const color = linearColor(light);
  if (light.kind === "directional") return { kind: "directional", direction: light.direction, color };
  if (light.kind === "environment") return { kind: "environment", file: light.file, color };
  if (light.kind === "named") return { kind: "named", name: light.name, color };
  if (light.kind === "area") {
    const [u, v] = sides(light);
    return { kind: "area", position: light.position, u, v, color, a0: light.a0 };
  }
  const { position, a0, falloff, radius } = light;
  if (light.kind === "sphere") return { kind: "sphere", position, size: light.size, color, a0, falloff, radius };
  if (light.kind === "point") return { kind: "point", position, color, a0, falloff, radius };
  const [inner, outer] = [(light.inner * Math.PI) / 180, (light.outer * Math.PI) / 180];
  return { kind: "spot", position, direction: aim(light), inner, outer, color, a0, falloff, radius };
}

function download(name: string, blob: Blob): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}
