/**
 * Lights to relight by: directional, point, spot, sphere, area, environment, named. Meters, radians, scene-linear Rec.709; the asset's own world, Blender's: right-handed,
 * z up. The arithmetic is that of `srbf/lights.py`, in double precision.
 */
import { SrbfError } from "./errors";
import type { Links } from "./light_linking";
import { type Profile, profileAxes, rollOf } from "./light_profile";
import { carried, cross, determinant, type Matrix4, type Triple, turned } from "./matrix";

export const DEFAULT_RADIUS = 1e-4; // meters: least distance to a receiver, so that a point light in a surface stays finite
const WHITE: Triple = [1, 1, 1];

/** A light at infinity: `direction` points from the surface to the light, `color` is its irradiance on a surface facing it. */
export interface DirectionalLight extends Links {
  readonly kind: "directional";
  readonly direction: Triple;
  readonly color: Triple;
  /** Angular diameter of its disc, rad, for soft shadows; that of the asset unless given. */
  readonly angle?: number;
}

/** A point light; `color` is its irradiance at the distance `a0` (m); |L| is never less than `radius` (m). */
interface Punctual extends Links {
  readonly position: Triple;
  readonly color: Triple;
  readonly a0: number;
  /** `linear`: a0/|L|, the article's; `inverse-square`: its square. */
  readonly falloff: "linear" | "inverse-square";
  readonly radius: number;
  /** What share of its strength goes into each direction; without, the same. */
  readonly profile?: Profile;
  /** Where a profile's axis points from the light, unit; straight down unless given. A spot's is its own. */
  readonly direction?: Triple;
  /** Turns a profile about its axis, counterclockwise for one who looks against the light, rad. */
  readonly roll?: number;
}

export interface PointLight extends Punctual {
  readonly kind: "point";
}

/** A point light times a smooth cone about `direction` (where it shines): full inside the half-angle `inner`, none past `outer` (rad). */
export interface SpotLight extends Punctual {
  readonly kind: "spot";
  readonly direction: Triple;
  readonly inner: number;
  readonly outer: number;
  /** Radius (m) of a sphere each point of which shines into the cone; a point unless given. */
  readonly size?: number;
}

/** A sphere of radius `size` (m) that shines: far away a point light, its shadows are soft. */
export interface SphereLight extends Punctual {
  readonly kind: "sphere";
  readonly size: number;
}

/**
 * A rectangle about `position` with the sides `u` and `v` (m) that shines towards u x v alone, evenly from every direction: `color` is the irradiance
 * on its axis at the distance `a0` (m), where that is far away; E = color a0^2 / A times the integral of cos cos / r^2 over its area A.
 */
export interface AreaLight extends Links {
  readonly kind: "area";
  readonly position: Triple;
  readonly u: Triple;
  readonly v: Triple;
  readonly color: Triple;
  readonly a0: number;
}

/** An equirectangular radiance map, `width` x `height` RGB: u = 1/2 - atan2(y, x) / 2 pi, top row first and towards +z; `turn`: about +z, rad, counterclockwise seen from above. */
export interface EnvironmentLight {
  readonly kind: "environment";
  readonly width: number;
  readonly height: number;
  readonly pixels: ArrayLike<number>;
  readonly color: Triple;
  readonly turn?: number;
}

/** A light of the scene by its name; `color` is its intensity times its hue, 1 as the scene has it set. */
export interface NamedLight {
  readonly kind: "named";
  readonly name: string;
  readonly color: Triple;
}

export type Light = DirectionalLight | PointLight | SpotLight | SphereLight | AreaLight | EnvironmentLight | NamedLight;
export type PunctualLight = PointLight | SpotLight | SphereLight;

/** What may be left out of a light of a place. Links are given to any light as `{ ...light, receivers, blockers }`. */
type Options = Partial<Omit<Punctual, "position" | keyof Links>>;

/** @throws SrbfError on a direction of no length, and an angle outside [0, pi). */
export function directionalLight(direction: Triple, color: Triple = WHITE, angle?: number): DirectionalLight {
  if (angle !== undefined && !(0 <= angle && angle < Math.PI)) throw new SrbfError(`expected an angle of 0 to pi rad, found ${angle}`);
  return { kind: "directional", direction: unit(direction), color: finite(color, "color"), ...(angle === undefined ? {} : { angle }) };
}

/** @throws SrbfError on numbers that are not finite, or a0 or radius not above 0. */
export function pointLight(position: Triple, options: Options = {}): PointLight {
  refuseProjected(options);
  return { kind: "point", ...punctual(position, options) };
}

/** @throws SrbfError as `pointLight`, on half-angles that are not 0 <= inner <= outer <= pi, and on a negative size. */
export function spotLight(
  position: Triple,
  direction: Triple,
  cone: { inner: number; outer: number },
  options: Options & { size?: number } = {},
): SpotLight {
  const { inner, outer } = cone;
  if (!(0 <= inner && inner <= outer && outer <= Math.PI)) {
    throw new SrbfError(`expected spot half-angles 0 <= inner <= outer <= pi rad, found inner ${inner}, outer ${outer}`);
  }
  if (options.profile?.projected && !(outer < Math.PI / 2)) throw new SrbfError(`expected a spot of an outer half-angle below pi / 2 to project an image, found ${outer}`);
  const { size = 0, ...fade } = options;
  if (!(size >= 0 && Number.isFinite(size))) throw new SrbfError(`expected size of 0 or above, found ${size}`);
  const own = punctual(position, fade);
  return { kind: "spot", ...own, direction: unit(direction), inner, outer, ...(size ? { size, radius: Math.max(own.radius, size) } : {}) };
}

/** Inverse-square unless `falloff` says otherwise; inside the sphere as strong as on its surface. @throws SrbfError as `pointLight`, and on a size not above 0. */
export function sphereLight(position: Triple, size: number, options: Options = {}): SphereLight {
  refuseProjected(options);
  if (!(size > 0 && Number.isFinite(size))) throw new SrbfError(`expected size above 0, found ${size}`);
  const own = punctual(position, { falloff: "inverse-square", ...options });
  return { kind: "sphere", ...own, size, radius: Math.max(own.radius, size) };
}

/** @throws SrbfError on numbers that are not finite, sides that span no rectangle, or a0 not above 0. */
export function areaLight(position: Triple, u: Triple, v: Triple, options: { color?: Triple; a0?: number } = {}): AreaLight {
  const { color = WHITE, a0 = 1 } = options;
  if (!(a0 > 0 && Number.isFinite(a0))) throw new SrbfError(`expected a0 above 0, found ${a0}`);
  unit(cross(finite(u, "u"), finite(v, "v")));
  return { kind: "area", position: finite(position, "position"), u, v, color: finite(color, "color"), a0 };
}

/** @throws SrbfError where `pixels` are not width x height x 3 finite numbers, or `turn` is not finite. */
export function environmentLight(width: number, height: number, pixels: ArrayLike<number>, color: Triple = WHITE, turn = 0): EnvironmentLight {
  if (!(width > 0 && height > 0) || pixels.length !== width * height * 3) {
    throw new SrbfError(`expected ${width} x ${height} x 3 numbers of an environment, found ${pixels.length}; drop alpha, if it has any`);
  }
  for (let i = 0; i < pixels.length; ++i) {
    if (!Number.isFinite(pixels[i])) throw new SrbfError("expected a finite environment image, found NaN or Inf pixels");
  }
  if (!Number.isFinite(turn)) throw new SrbfError(`expected a turn in radians, found ${turn}`);
  return { kind: "environment", width, height, pixels, color: finite(color, "color"), ...(turn ? { turn } : {}) };
}

/** @throws SrbfError on a color that is not finite. */
export function namedLight(name: string, color: Triple = WHITE): NamedLight {
  return { kind: "named", name, color: finite(color, "color") };
}

/** A light under a rigid motion and uniform scale, which also scales a0 and radius; environments and named lights are unchanged: `inAssetFrame` turns an environment's directions. */
export function moved<L extends Light>(light: L, matrix: Matrix4): L {
  if (light.kind === "environment" || light.kind === "named") return light;
  if (light.kind === "directional") return { ...light, direction: unit(turned(matrix, light.direction)) };
  const scale = Math.cbrt(Math.abs(determinant(matrix)));
  if (light.kind === "area") {
    return { ...light, position: carried(matrix, light.position), u: turned(matrix, light.u), v: turned(matrix, light.v), a0: light.a0 * scale };
  }
  const out = { ...light, position: carried(matrix, light.position), a0: light.a0 * scale, radius: light.radius * scale };
  if (light.direction && (light.kind === "spot" || light.profile)) {
    const direction = unit(turned(matrix, light.direction));
    const roll = light.profile ? { roll: rollOf(direction, turned(matrix, profileAxes(light.direction, light.roll ?? 0)[0])) } : {};
    Object.assign(out, { direction, ...roll });
  }
  return "size" in light && light.size ? { ...out, size: light.size * scale } : out;
}

export function isPunctual(light: Light): light is PunctualLight {
  return light.kind === "point" || light.kind === "spot" || light.kind === "sphere";
}

/** @throws SrbfError on a vector that is zero or not finite. */
export function unit(v: Triple): Triple {
  const largest = Math.max(Math.abs(v[0]), Math.abs(v[1]), Math.abs(v[2])); // so that no square over- or underflows
  const scaled = v.map((x) => x / Math.max(largest, 1e-300));
  const length = Math.hypot(...scaled);
  if (!(Number.isFinite(length) && length >= 1e-12)) {
    throw new SrbfError(`expected a direction of non-zero, finite length, found ${v.join(", ")}; give x, y, z not all zero`);
  }
  return [scaled[0] / length, scaled[1] / length, scaled[2] / length];
}

function punctual(position: Triple, options: Options): Punctual {
  const { color = WHITE, a0 = 1, falloff = "linear", radius = DEFAULT_RADIUS } = options;
  for (const [name, value] of Object.entries({ a0, radius })) {
    if (!(Number.isFinite(value) && value > 0)) throw new SrbfError(`expected ${name} above 0, found ${value}`);
  }
  if (falloff !== "linear" && falloff !== "inverse-square") throw new SrbfError(`expected a falloff of linear, inverse-square, found ${falloff}`);
  const { profile, direction = [0, 0, -1], roll = 0 } = options;
  if (!Number.isFinite(roll)) throw new SrbfError(`expected a finite roll, found ${roll}`);
  return { position: finite(position, "position"), color: finite(color, "color"), a0, falloff, radius, ...(profile ? { profile, direction: unit(direction), roll } : {}) };
}

function refuseProjected({ profile }: { profile?: Profile }): void {
  if (profile?.projected) throw new SrbfError("expected a spot of an outer half-angle below pi / 2 to project an image, found another light");
}

function finite(v: Triple, name: string): Triple {
  if (v.length !== 3 || !v.every(Number.isFinite)) throw new SrbfError(`expected ${name} as three finite numbers, found ${v.join(", ")}`);
  return v;
}
