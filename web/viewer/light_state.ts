/** Lights as the page and its URL hold them: numbers are rounded when they are set, so that page, URL and FRAMES.json agree. */
import { directionalLight, environmentLight, type Light, pointLight, spotLight, SrbfError, type Triple } from "../src";
import type { Environment } from "./environment_file";

interface Common {
  on: boolean;
  /** sRGB, #rrggbb. */
  color: string;
  /** Times the color, linear: irradiance of a directional light, and of a point or spot light at a0; an environment's scale. */
  intensity: number;
}

interface PointLight extends Common {
  position: Triple;
  a0: number;
  falloff: "linear" | "inverse-square";
  radius: number;
}

export interface DirectionalState extends Common {
  kind: "directional";
  direction: Triple;
}

export interface PointState extends PointLight {
  kind: "point";
}

/** Half-angles in degrees; it is aimed at `target`. */
export interface SpotState extends PointLight {
  kind: "spot";
  target: Triple;
  inner: number;
  outer: number;
}

export interface EnvironmentState extends Common {
  kind: "environment";
  file: string;
}

export type PointLightState = PointState | SpotState;
export type LightState = DirectionalState | PointLightState | EnvironmentState;

const COMMON = { on: true, color: "#ffffff", intensity: 1 };

export const directionalState = (direction: Triple): DirectionalState => ({ kind: "directional", ...COMMON, direction: rounded(direction) });

export const pointState = (position: Triple, a0: number): PointState => ({
  kind: "point",
  ...COMMON,
  position: rounded(position),
  a0: round(a0),
  falloff: "inverse-square",
  radius: 0.001,
});

export const spotState = (position: Triple, target: Triple, a0: number): SpotState => ({
  ...pointState(position, a0),
  kind: "spot",
  target: rounded(target),
  inner: 20,
  outer: 30,
});

export const environmentState = (file: string): EnvironmentState => ({ kind: "environment", ...COMMON, file });

export function isPointLightState(light: LightState | undefined): light is PointLightState {
  return light?.kind === "point" || light?.kind === "spot";
}

/** Five decimals: a hundredth of a millimeter, a thousandth of a degree. */
export const round = (x: number): number => Math.round(x * 1e5) / 1e5 + 0;

export const rounded = (v: Triple): Triple => [round(v[0]), round(v[1]), round(v[2])];

/** Linear Rec.709 of an sRGB #rrggbb times `intensity` [IEC61966]. */
export function linearColor(light: Common): Triple {
  const channel = (at: number) => {
    const s = Number.parseInt(light.color.slice(at, at + 2), 16) / 255;
    return light.intensity * (s <= 0.04045 ? s / 12.92 : ((s + 0.055) / 1.055) ** 2.4);
  };
  return [channel(1), channel(3), channel(5)];
}

/** The library's light; undefined where it is off, or its environment map has not been dropped yet. @throws SrbfError on invalid numbers. */
export function lightOf(state: LightState, environments: ReadonlyMap<string, Environment>): Light | undefined {
  if (!state.on) return undefined;
  const color = linearColor(state);
  if (state.kind === "directional") return directionalLight(state.direction, color);
  if (state.kind === "environment") {
    const image = environments.get(state.file);
    return image && environmentLight(image.width, image.height, image.pixels, color);
  }
  const { position, a0, falloff, radius } = state;
  if (state.kind === "point") return pointLight(position, { color, a0, falloff, radius });
  const cone = { inner: (state.inner * Math.PI) / 180, outer: (state.outer * Math.PI) / 180 };
  return spotLight(position, aim(state), cone, { color, a0, falloff, radius });
}

export function aim(spot: SpotState): Triple {
  const { position: p, target: t } = spot;
  const direction: Triple = [t[0] - p[0], t[1] - p[1], t[2] - p[2]];
  return direction.some((x) => x !== 0) ? direction : [0, 0, -1];
}

/** `value` as a light's state. @throws SrbfError on anything else. */
export function checkLight(value: unknown): LightState {
  const light = value as Record<string, unknown>;
  const bad = (what: string): never => {
    throw new SrbfError(`expected ${what} in the page's address, found ${JSON.stringify(light?.[what.split(" ").pop() as string]) ?? "none"}`);
  };
  const triple = (key: string) => {
    const v = light[key];
    if (!(Array.isArray(v) && v.length === 3 && v.every((x) => Number.isFinite(x)))) bad(`three numbers of ${key}`);
  };
  if (typeof light !== "object" || light === null) bad("a light");
  if (typeof light.on !== "boolean") bad("true or false of on");
  if (typeof light.color !== "string" || !/^#[0-9a-f]{6}$/.test(light.color)) bad("#rrggbb of color");
  if (!Number.isFinite(light.intensity)) bad("a number of intensity");
  if (light.kind === "directional") triple("direction");
  else if (light.kind === "environment") {
    if (typeof light.file !== "string") bad("a name of file");
  } else if (light.kind === "point" || light.kind === "spot") {
    triple("position");
    for (const key of ["a0", "radius"]) if (!((light[key] as number) > 0 && Number.isFinite(light[key]))) bad(`a number above 0 of ${key}`);
    if (light.falloff !== "linear" && light.falloff !== "inverse-square") bad("linear or inverse-square of falloff");
    if (light.kind === "spot") {
      triple("target");
      if (!((light.inner as number) >= 0 && (light.inner as number) <= (light.outer as number) && (light.outer as number) <= 180)) bad("half-angles of inner");
    }
  } else bad("a kind of kind");
  return light as unknown as LightState;
}
