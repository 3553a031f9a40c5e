/** Jobs that the tests send to a page, and their results. */
import { areaLight, directionalLight, type EnvironmentLight, environmentLight, type Light, type Links, namedLight, type Objects, pointLight, Profile, sphereLight, spotLight, type Triple } from "../../src";
import { linksOf } from "../../src/light_linking";

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

let lastMap: EnvironmentLight | undefined; // what an environment without pixels turns

/** With what it chooses of the scene's objects. */
export function lightOfJson(json: LightJson): Light {
  const choice = (own: unknown) => own && (Object.fromEntries(Object.entries(own).filter(([, names]) => names !== null)) as Objects);
  const links = { receivers: choice(json.receivers), blockers: choice(json.blockers) } as Links;
  const light = unlinked(json);
  return light.kind === "environment" || light.kind === "named" ? light : { ...light, ...linksOf(links) };
}

function unlinked(json: LightJson): Light {
  const shape = json.profile ? { profile: profileOf(json.profile as ProfileJson), direction: json.direction as Triple, roll: json.roll as number } : {};
  const options = { color: json.color, a0: json.a0 as number, falloff: json.falloff as "linear", radius: json.radius as number, ...shape };
  if (json.kind === "directional") return directionalLight(json.direction as Triple, json.color);
  if (json.kind === "point") return pointLight(json.position as Triple, options);
  if (json.kind === "spot") {
    return spotLight(json.position as Triple, json.direction as Triple, { inner: json.inner as number, outer: json.outer as number }, options);
  }
  if (json.kind === "sphere") return sphereLight(json.position as Triple, json.size as number, options);
  if (json.kind === "area") return areaLight(json.position as Triple, json.u as Triple, json.v as Triple, { color: json.color, a0: json.a0 as number });
  if (json.kind === "named") return namedLight(json.name as string, json.color);
  if (json.pixels) lastMap = environmentLight(json.width as number, json.height as number, json.pixels as number[]);
  return { ...(lastMap as EnvironmentLight), color: json.color, turn: json.turn as number | undefined };
}

/** A table row by row, RGB, as `srbf.light_profile.Profile` has it. */
interface ProfileJson {
  width: number;
  height: number;
  numbers: number[];
  projected: boolean;
}

const profiles = new Map<string, Profile>();

/** Equal ones are one. */
function profileOf(json: ProfileJson): Profile {
  const key = JSON.stringify(json);
  const { width, height, numbers, projected } = json;
  const found = profiles.get(key) ?? new Profile({ kind: "float", width, height, channels: 3, data: new Float32Array(numbers) }, projected);
  profiles.set(key, found);
  return found;
}

interface Mixed {
  setNamedLight(name: string, intensity: number, color: Triple): unknown;
}

/** Set the named lights of a job: [name, intensity, color] each. */
export function mix(job: Job, map: Mixed): void {
  for (const [name, intensity, color] of (job.named as [string, number, Triple][]) ?? []) map.setNamedLight(name, intensity, color);
}

interface Changing {
  setAlbedo(name: string, color?: Triple): unknown;
  setEmission(name: string, radiance: Triple): unknown;
}

/** Change surfaces before picture `i` of a job: `changes` has [albedo or emission, object, color] of each; no color is the object's own. */
export function change(job: Job, map: Changing, i: number): void {
  for (const [kind, name, color] of (job.changes as ["albedo" | "emission", string, Triple | undefined][][])?.[i] ?? []) {
    if (kind === "albedo") map.setAlbedo(name, color ?? undefined);
    else map.setEmission(name, color as Triple);
  }
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
