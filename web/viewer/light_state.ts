/** Lights as the page and its URL hold them: numbers are rounded when they are set, so that page, URL and FRAMES.json agree. */
import { areaLight, directionalLight, type EnvironmentLight, environmentLight, type Light, type Links, namedLight, pointLight, type Profile, sphereLight, spotLight, SrbfError, type Triple } from "../src";
import { isLinkable } from "../src/light_linking";
import { unit } from "../src/lights";
import { cross } from "../src/matrix";
import type { Environment } from "./environment_file";

interface Common {
  on: boolean;
  /** sRGB, #rrggbb. */
  color: string;
  /** Times the color, linear: irradiance of a directional light, and of a point or spot light at a0; an environment's scale. */
  intensity: number;
  /** Whether it shines alone, with others that do. */
  solo?: boolean;
  /** The temperature that gave the color, K. */
  kelvin?: number;
  /** Which of the scene's lights it is. */
  name?: string;
  /** Which objects it shines on, and which shadow it: all unless given. */
  links?: Links;
}

interface PointLight extends Common {
  position: Triple;
  a0: number;
  falloff: "linear" | "inverse-square";
  radius: number;
  /** The name of the profile that shapes it, about `direction` (of a spot its aim, else straight down unless given), turned by `roll` (degrees). */
  profile?: string;
  direction?: Triple;
  roll?: number;
}

export interface DirectionalState extends Common {
  kind: "directional";
  direction: Triple;
  /** Diameter of the sun's disc, degrees; that of the asset unless given. */
  angle?: number;
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
  /** Radius of what shines, m; a point unless given. */
  size?: number;
}

/** A sphere of radius `size`, m. */
export interface SphereState extends PointLight {
  kind: "sphere";
  size: number;
}

/** A rectangle that shines towards `target`: its first side is horizontal, turned about its axis by `turn` (degrees). */
export interface AreaState extends Common {
  kind: "area";
  position: Triple;
  target: Triple;
  width: number;
  height: number;
  turn: number;
  a0: number;
}

export interface EnvironmentState extends Common {
  kind: "environment";
  file: string;
  /** About the vertical, degrees, counterclockwise seen from above. */
  turn?: number;
}

/** A light of the scene: intensity 1 and white as it is set there. */
export interface NamedState extends Common {
  kind: "named";
  name: string;
}

export type PointLightState = PointState | SpotState | SphereState;
/** Lights with a place in the scene. */
export type PlacedState = PointLightState | AreaState;
export type LightState = DirectionalState | PlacedState | EnvironmentState | NamedState;

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

export const sphereState = (position: Triple, a0: number): SphereState => ({ ...pointState(position, a0), kind: "sphere", size: round(0.1 * a0) });

export const areaState = (position: Triple, target: Triple, a0: number): AreaState => ({
  kind: "area",
  ...COMMON,
  position: rounded(position),
  target: rounded(target),
  width: round(0.5 * a0),
  height: round(0.3 * a0),
  turn: 0,
  a0: round(a0),
});

export const environmentState = (file: string): EnvironmentState => ({ kind: "environment", ...COMMON, file });

export const namedState = (name: string): NamedState => ({ kind: "named", ...COMMON, name });

/** Whether a light is as the scene has it set. */
export const isDesigned = ({ on, color, intensity }: NamedState): boolean => on && intensity === 1 && color === COMMON.color;

/** The selected light of a kind, else the first one. */
function chosen<T extends LightState>({ lights, selected }: Chosen, is: (light: LightState | undefined) => light is T): T | undefined {
  const light = lights[selected];
  return is(light) ? light : lights.find(is);
}

interface Chosen {
  readonly lights: readonly LightState[];
  readonly selected: number;
}

export const sunOf = (state: Chosen): DirectionalState | undefined => chosen(state, (light): light is DirectionalState => light?.kind === "directional");
export const placedOf = (state: Chosen): PlacedState | undefined => chosen(state, isPlaced);

export function isPlaced(light: LightState | undefined): light is PlacedState {
  return light?.kind === "point" || light?.kind === "spot" || light?.kind === "sphere" || light?.kind === "area";
}

/** Placed lights that are aimed. */
export function isAimed(light: LightState | undefined): light is SpotState | AreaState {
  return light?.kind === "spot" || light?.kind === "area";
}

/** Five decimals: a hundredth of a millimeter, a thousandth of a degree. */
export const round = (x: number): number => Math.round(x * 1e5) / 1e5 + 0;

export const rounded = (v: Triple): Triple => [round(v[0]), round(v[1]), round(v[2])];

/** Those that shine: the ones that are on, or of these the solo ones where there are any. */
export function shiningOf<L extends LightState>(lights: readonly L[]): L[] {
  const on = lights.filter((light) => light.on);
  const alone = on.filter(({ solo }) => solo);
  return alone.length ? alone : on;
}

/** Linear Rec.709 of an sRGB #rrggbb times `intensity` [IEC61966]. */
export function linearColor(light: Common): Triple {
  const channel = (at: number) => {
    const s = Number.parseInt(light.color.slice(at, at + 2), 16) / 255;
    return light.intensity * (s <= 0.04045 ? s / 12.92 : ((s + 0.055) / 1.055) ** 2.4);
  };
  return [channel(1), channel(3), channel(5)];
}

/**
 * The library's light; undefined where it is off, or its environment map has not been dropped yet. One whose profile is not among `profiles` shines
 * without it. @throws SrbfError on invalid numbers.
 */
export function lightOf(state: LightState, environments: ReadonlyMap<string, Environment>, profiles: ReadonlyMap<string, Profile> = new Map()): Light | undefined {
  const light = state.on ? unlinked(state, environments, profiles) : undefined;
  return light && light.kind !== "environment" && light.kind !== "named" ? { ...light, ...state.links } : light;
}

function unlinked(state: LightState, environments: ReadonlyMap<string, Environment>, profiles: ReadonlyMap<string, Profile>): Light | undefined {
  const color = linearColor(state);
  if (state.kind === "directional") return directionalLight(state.direction, color, state.angle === undefined ? undefined : (state.angle * Math.PI) / 180);
  if (state.kind === "environment") {
    const image = environments.get(state.file);
    return image && { ...checked(image), color, turn: ((state.turn ?? 0) * Math.PI) / 180 };
  }
  if (state.kind === "named") return namedLight(state.name, color);
  if (state.kind === "area") return areaLight(state.position, ...sides(state), { color, a0: state.a0 });
  const { position, a0, falloff, radius } = state;
  const fade = { color, a0, falloff, radius, ...shapeOf(state, profiles) };
  if (state.kind === "point") return pointLight(position, fade);
  if (state.kind === "sphere") return sphereLight(position, state.size, fade);
  const cone = { inner: (state.inner * Math.PI) / 180, outer: (state.outer * Math.PI) / 180 };
  return spotLight(position, aim(state), cone, { ...fade, size: state.size });
}

const known = new WeakMap<Environment, EnvironmentLight>();

/** A map as a light; its pixels are looked at once. @throws SrbfError on pixels that are not finite. */
function checked(image: Environment): EnvironmentLight {
  const light = known.get(image) ?? environmentLight(image.width, image.height, image.pixels);
  known.set(image, light);
  return light;
}

function shapeOf({ profile, direction, roll = 0 }: PointLight, profiles: ReadonlyMap<string, Profile>): { profile?: Profile; direction?: Triple; roll?: number } {
  const found = profile === undefined ? undefined : profiles.get(profile);
  return found ? { profile: found, direction, roll: (roll * Math.PI) / 180 } : {};
}

/** The two sides of an area, m. */
export function sides(area: AreaState): [Triple, Triple] {
  const facing = unit(aim(area));
  const [level, other] = levelSides(facing);
  const [c, s] = [Math.cos((area.turn * Math.PI) / 180), Math.sin((area.turn * Math.PI) / 180)];
  const along = (a: number, b: number) => [0, 1, 2].map((k) => a * level[k] + b * other[k]) as unknown as Triple;
  return [along(area.width * c, area.width * s), along(-area.height * s, area.height * c)];
}

/** Unit vectors across a unit direction, the first horizontal; their cross product is the direction. */
export function levelSides(facing: Triple): [Triple, Triple] {
  const level = unit(Math.abs(facing[2]) < 0.999 ? cross([0, 0, 1], facing) : cross([0, 1, 0], facing));
  return [level, cross(facing, level)];
}

export function aim(light: SpotState | AreaState): Triple {
  const { position: p, target: t } = light;
  const direction: Triple = [t[0] - p[0], t[1] - p[1], t[2] - p[2]];
  return direction.some((x) => x !== 0) ? direction : [0, 0, -1];
}

/** Whether a value of a file or an address is what lights choose of objects. */
export function areLinks(value: unknown): value is Links {
  const object = (one: unknown): one is Record<string, unknown> => typeof one === "object" && one !== null && !Array.isArray(one);
  const names = (one: unknown) => Array.isArray(one) && one.every((name) => typeof name === "string" && name !== "");
  const choice = (one: unknown) => object(one) && Object.entries(one).every(([key, own]) => ["only", "without"].includes(key) && names(own));
  return object(value) && Object.entries(value).every(([key, own]) => ["receivers", "blockers"].includes(key) && choice(own));
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
  if (light.solo !== undefined && typeof light.solo !== "boolean") bad("true or false of solo");
  if (light.name !== undefined && (typeof light.name !== "string" || light.name === "")) bad("a text of name");
  if (light.links !== undefined && !(areLinks(light.links) && isLinkable(light.kind))) bad("receivers and blockers, {only, without} of names, of links");
  if (light.kelvin !== undefined && !((light.kelvin as number) > 0)) bad("a number above 0 of kelvin");
  if (light.kind === "directional") {
    triple("direction");
    if (light.angle !== undefined && !((light.angle as number) >= 0 && (light.angle as number) < 180)) bad("degrees of angle");
  } else if (light.kind === "environment") {
    if (typeof light.file !== "string") bad("a name of file");
    if (light.turn !== undefined && !Number.isFinite(light.turn)) bad("degrees of turn");
  } else if (light.kind === "named") {
    if (typeof light.name !== "string") bad("a light's name");
  } else if (light.kind === "area") {
    for (const key of ["position", "target"]) triple(key);
    for (const key of ["a0", "width", "height"]) if (!((light[key] as number) > 0 && Number.isFinite(light[key]))) bad(`a number above 0 of ${key}`);
    if (!Number.isFinite(light.turn)) bad("a number of turn");
  } else if (light.kind === "point" || light.kind === "spot" || light.kind === "sphere") {
    triple("position");
    for (const key of light.kind === "sphere" ? ["a0", "radius", "size"] : ["a0", "radius"]) if (!((light[key] as number) > 0 && Number.isFinite(light[key]))) bad(`a number above 0 of ${key}`);
    if (light.profile !== undefined && (typeof light.profile !== "string" || light.profile === "")) bad("a name of profile");
    if (light.direction !== undefined) triple("direction");
    if (light.roll !== undefined && !Number.isFinite(light.roll)) bad("a number of roll");
    if (light.falloff !== "linear" && light.falloff !== "inverse-square") bad("linear or inverse-square of falloff");
    if (light.kind === "spot") {
      triple("target");
      if (light.size !== undefined && !((light.size as number) >= 0 && Number.isFinite(light.size))) bad("a number of 0 or above of size");
      if (!((light.inner as number) >= 0 && (light.inner as number) <= (light.outer as number) && (light.outer as number) <= 180)) bad("half-angles of inner");
    }
  } else bad("a kind of kind");
  return light as unknown as LightState;
}
