/** Files that the page hands out: a PNG, and FRAMES.json for `srbf relight --lights`. */
import { encode } from "fast-png";
import { aim, type LightState, linearColor } from "./light_state";

export function savePng(name: string, image: { width: number; height: number; data: Uint8Array }): void {
  const rgb = new Uint8Array((image.data.length / 4) * 3);
  for (let i = 0, j = 0; i < image.data.length; i += 4, j += 3) rgb.set(image.data.subarray(i, i + 3), j);
  handOut(name, new Blob([encode({ width: image.width, height: image.height, channels: 3, data: rgb }) as BlobPart], { type: "image/png" }));
}

export function saveFrames(name: string, frames: readonly (readonly LightState[])[]): void {
  const json = { frames: frames.map((lights) => ({ lights: lights.filter((light) => light.on).map(entry) })) };
  handOut(name, new Blob([`${JSON.stringify(json, undefined, 1)}\n`], { type: "application/json" }));
}

/** A light as srbf/schemas/frames.schema.json has it; an environment's file is looked for beside FRAMES.json. */
function entry(light: LightState): Record<string, unknown> {
  const color = linearColor(light);
  if (light.kind === "directional") return { kind: "directional", direction: light.direction, color };
  if (light.kind === "environment") return { kind: "environment", file: light.file, color };
  const { position, a0, falloff, radius } = light;
  if (light.kind === "point") return { kind: "point", position, color, a0, falloff, radius };
  const [inner, outer] = [(light.inner * Math.PI) / 180, (light.outer * Math.PI) / 180];
  return { kind: "spot", position, direction: aim(light), inner, outer, color, a0, falloff, radius };
}

function handOut(name: string, blob: Blob): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}
