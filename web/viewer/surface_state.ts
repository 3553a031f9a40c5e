/** What the page changes of an asset's surfaces: objects that emit, and those that are repainted. */
import { type Asset, namedLight, type NamedLight, SrbfError } from "../src";
import { linearColor, type NamedState, namedState } from "./light_state";

/** An object; colors are sRGB, #rrggbb. */
export interface SurfaceState {
  name: string;
  /** Times its color, linear: radiance. */
  strength: number;
  emission: string;
  /** Undefined: as baked. */
  albedo?: string;
}

export const surfaceState = (name: string): SurfaceState => ({ name, strength: 0, emission: "#ffffff" });

/** Whether an object is as the capture has it. */
export const isBaked = ({ strength, albedo }: SurfaceState): boolean => strength === 0 && albedo === undefined;

/** The objects that an asset lets one change, none of most assets, and whether they can be repainted. */
export const surfaceFacts = ({ tables, manifest }: Asset) => ({ objects: tables.surfaces?.names ?? [], paintable: manifest.quantity === "irradiance" });

/** The emitting objects as lights of the page, for FRAMES.json. */
export function emittingStates(asset: Asset, surfaces: readonly SurfaceState[]): NamedState[] {
  const known = surfaceFacts(asset).objects;
  const shining = surfaces.filter(({ name, strength }) => strength > 0 && known.includes(name));
  return shining.map(({ name, strength, emission }) => ({ ...namedState(name), color: emission, intensity: strength }));
}

/** … and as lights of the library. */
export function emitting(asset: Asset, surfaces: readonly SurfaceState[]): NamedLight[] {
  return emittingStates(asset, surfaces).map((state) => namedLight(state.name, linearColor(state)));
}

/** Repaint the asset as the page has it; what is as before costs nothing. */
export function paint(asset: Asset, surfaces: readonly SurfaceState[]): void {
  const { objects, paintable } = surfaceFacts(asset);
  if (!paintable) return;
  for (const name of objects) {
    const albedo = surfaces.find((one) => one.name === name)?.albedo;
    asset.tables.surfaces?.setAlbedo(name, albedo === undefined ? undefined : linearColor({ on: true, color: albedo, intensity: 1 }));
  }
}

/** `value` as changed surfaces. @throws SrbfError on anything else. */
export function checkSurfaces(value: unknown): SurfaceState[] {
  const color = (text: unknown) => typeof text === "string" && /^#[0-9a-f]{6}$/.test(text);
  const fits = ({ name, strength, emission, albedo }: Partial<SurfaceState>) =>
    typeof name === "string" && Number.isFinite(strength) && (strength as number) >= 0 && color(emission) && (albedo === undefined || color(albedo));
  if (!Array.isArray(value) || !value.every((one) => typeof one === "object" && one !== null && fits(one))) {
    throw new SrbfError(`expected objects with a strength and colors in the page's address, found ${JSON.stringify(value)}; the page uses its defaults`);
  }
  return value as SurfaceState[];
}
