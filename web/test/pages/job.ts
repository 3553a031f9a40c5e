/** Jobs that the tests send to a page, and their results. */
import { directionalLight, environmentLight, type Light, pointLight, spotLight, type Triple } from "../../src";

export interface Job {
  run: string;
  /** Where the asset is served. */
  asset: string;
  lights: LightJson[];
  lightSets: LightJson[][];
  target?: "float" | "half";
  [option: string]: unknown;
}

/** Lights as Python dumps them: the fields of its classes, and `kind`. */
export type LightJson = { kind: string; color: Triple } & Record<string, unknown>;

export interface Picture {
  width: number;
  height: number;
  /** RGBA float32, row 0 at the top, base64. */
  pixels: string;
}

export function lightOfJson(json: LightJson): Light {
  const options = { color: json.color, a0: json.a0 as number, falloff: json.falloff as "linear", radius: json.radius as number };
  if (json.kind === "directional") return directionalLight(json.direction as Triple, json.color);
  if (json.kind === "point") return pointLight(json.position as Triple, options);
  if (json.kind === "spot") {
    return spotLight(json.position as Triple, json.direction as Triple, { inner: json.inner as number, outer: json.outer as number }, options);
  }
  return environmentLight(json.width as number, json.height as number, json.pixels as number[], json.color);
}

export function picture(width: number, height: number, pixels: Float32Array): Picture {
  const bytes = new Uint8Array(pixels.buffer, pixels.byteOffset, pixels.byteLength);
  let text = "";
  for (const byte of bytes) text += String.fromCharCode(byte);
  return { width, height, pixels: btoa(text) };
}

/** The same picture the other way up. */
export function upsideDown(pixels: Float32Array, height: number): Float32Array {
  const stride = pixels.length / height;
  const out = new Float32Array(pixels.length);
  for (let row = 0; row < height; ++row) out.set(pixels.subarray(row * stride, (row + 1) * stride), (height - 1 - row) * stride);
  return out;
}
