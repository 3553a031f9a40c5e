/** Members of the shaders' SrbfPointLight: `srbf/gl/uniforms.py`. */
import { type Profile, profileAxes } from "./light_profile";
import type { PunctualLight } from "./lights";
import type { Triple } from "./matrix";

export interface PointLightUniforms {
  position: Triple;
  /** The part of the position that single precision drops. */
  positionLow: Triple;
  color: Triple;
  axis: Triple;
  a0: number;
  radius: number;
  /** 1 - cos of a spot's half-angles; 3 and 4 for a point light. */
  versineInner: number;
  versineOuter: number;
  /** 0 linear, 1 inverse-square. */
  falloff: number;
}

/** The uniforms of a light that is already in the asset's frame. */
export function pointLightUniforms(light: PunctualLight): PointLightUniforms {
  const high = light.position.map(Math.fround) as unknown as Triple;
  return {
    position: high,
    positionLow: light.position.map((x, i) => x - high[i]) as unknown as Triple,
    color: light.color,
    axis: (light.kind === "spot" || light.profile ? light.direction : undefined) ?? [0, 0, 1],
    a0: light.a0,
    radius: light.radius,
    versineInner: light.kind === "spot" ? versine(light.inner) : 3,
    versineOuter: light.kind === "spot" ? versine(light.outer) : 4,
    falloff: light.falloff === "inverse-square" ? 1 : 0,
  };
}

/** What shaders know of a light's profile beside its texture, of a light in the asset's frame. */
export interface ProfileLook {
  readonly profile: Profile;
  /** Its x and y, unit. */
  readonly across: Triple;
  readonly up: Triple;
  /** Half of a projected image's width 1 m ahead; 0 of a profile by angles. */
  readonly tangent: number;
}

/** Undefined of a light without a profile. */
export function profileLook(light: PunctualLight): ProfileLook | undefined {
  if (!light.profile) return undefined;
  const [across, up] = profileAxes(light.direction ?? [0, 0, -1], light.roll ?? 0);
  return { profile: light.profile, across, up, tangent: light.kind === "spot" && light.profile.projected ? Math.tan(light.outer) : 0 };
}

/**
 * Lights as the shaders' arrays hold them, four vec4 each, zeros up to `room` lights: (position, radius), (positionLow, falloff), (color at 1 m,
 * versineInner), (axis, versineOuter).
 */
export function packedPointLights(pointLights: readonly PointLightUniforms[], room: number): Float32Array {
  const out = new Float32Array(16 * room);
  pointLights.forEach((pointLight, i) => {
    const atOne = pointLight.falloff === 1 ? pointLight.a0 ** 2 : pointLight.a0;
    const color = pointLight.color.map((component) => component * atOne);
    out.set([...pointLight.position, pointLight.radius, ...pointLight.positionLow, pointLight.falloff, ...color, pointLight.versineInner, ...pointLight.axis, pointLight.versineOuter], 16 * i);
  });
  return out;
}

/** Room for `count` lights in a program: a power of two, so that few programs serve any number. */
export function pointLightRoom(count: number): number {
  return 2 ** Math.ceil(Math.log2(Math.max(count, 1)));
}

/** 1 - cos of an angle (rad), precise for small ones. */
export function versine(angle: number): number {
  return 2 * Math.sin(angle / 2) ** 2;
}
