/** Files that the page saves: a PNG, FRAMES.json for `srbf relight --lights`, and a script for Blender. */
import { encode } from "fast-png";
import { blenderRig } from "./blender_rig";
import type { Triple } from "../src";
import { type Designed, exactColor } from "./asset_lights";
import { aim, type LightState, shiningOf, sides } from "./light_state";

/** RGBA where anything is transparent, RGB otherwise. */
export function savePng(name: string, image: { width: number; height: number; data: Uint8Array }): void {
  const { width, height, data: rgba } = image;
  const channels = rgba.some((byte, i) => i % 4 === 3 && byte < 255) ? 4 : 3;
  const data = channels === 4 ? rgba : rgba.filter((_, i) => i % 4 !== 3);
  download(name, new Blob([encode({ width, height, channels, data }) as BlobPart], { type: "image/png" }));
}

/** `designed`: the scene's own lights, whose colors are exact where they are as designed. Of a frame, `off` names those that do not shine. */
export function saveFrames(name: string, frames: readonly (readonly LightState[])[], designed: Designed = []): void {
  const json = { frames: frames.map((lights) => frameOf(lights, designed)) };
  download(name, new Blob([`${JSON.stringify(json, undefined, 1)}\n`], { type: "application/json" }));
}

/** A script that makes the lights in Blender, or sets those that the scene has. */
export function saveRig(name: string, lights: readonly LightState[], sunAngle: number, designed: Designed = []): void {
  download(name, new Blob([blenderRig(lights, sunAngle, designed)], { type: "text/x-python" }));
}

/** A frame of FRAMES.json. */
export function frameOf(lights: readonly LightState[], designed: Designed = []): { lights: Record<string, unknown>[]; off?: string[] } {
  const shining = new Set(shiningOf(lights));
  const shown = new Set([...shining].map(({ name }) => name));
  const known = [...designed.map(({ name }) => name), ...lights.map((light) => (light.kind === "named" ? undefined : light.name))];
  const off = [...new Set(known.filter((one): one is string => one !== undefined && !shown.has(one)))];
  return { lights: [...shining].map((light) => entry(light, designed)), ...(off.length ? { off } : {}) };
}

/** A light as srbf/schemas/frames.schema.json has it; an environment's file must lie beside FRAMES.json. */
function entry(light: LightState, designed: Designed): Record<string, unknown> {
  return { ...values(light, exactColor(light, designed)), ...light.links, ...(light.name === undefined ? {} : { name: light.name }) };
}

function values(light: LightState, color: Triple): Record<string, unknown> {
  if (light.kind === "directional") return { kind: "directional", direction: light.direction, color, ...(light.angle === undefined ? {} : { angle: (light.angle * Math.PI) / 180 }) };
  if (light.kind === "environment") return { kind: "environment", file: light.file, color, ...(light.turn ? { turn: (light.turn * Math.PI) / 180 } : {}) };
  if (light.kind === "named") return { kind: "named", name: light.name, color };
  if (light.kind === "area") {
    const [u, v] = sides(light);
    return { kind: "area", position: light.position, u, v, color, a0: light.a0 };
  }
  const { position, a0, falloff, radius, profile, direction, roll = 0 } = light;
  const shape = profile === undefined ? {} : { profile, roll: (roll * Math.PI) / 180, ...(direction && light.kind !== "spot" ? { direction } : {}) };
  const fade = { color, a0, falloff, radius, ...shape };
  if (light.kind === "sphere") return { kind: "sphere", position, size: light.size, ...fade };
  if (light.kind === "point") return { kind: "point", position, ...fade };
  const [inner, outer] = [(light.inner * Math.PI) / 180, (light.outer * Math.PI) / 180];
  return { kind: "spot", position, direction: aim(light), inner, outer, ...(light.size === undefined ? {} : { size: light.size }), ...fade };
}

function download(name: string, blob: Blob): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}
