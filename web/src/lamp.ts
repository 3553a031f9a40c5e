/** Members of the shaders' SrbfLamp: `srbf/gl/uniforms.py`. */
import type { LampLight } from "./lights";
import type { Triple } from "./matrix";

export interface LampUniforms {
  position: Triple;
  /** What single precision dropped of the position. */
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

/** The uniforms of a lamp that is already in the asset's frame. */
export function lampUniforms(light: LampLight): LampUniforms {
  const high = light.position.map(Math.fround) as unknown as Triple;
  return {
    position: high,
    positionLow: light.position.map((x, i) => x - high[i]) as unknown as Triple,
    color: light.color,
    axis: light.kind === "spot" ? light.direction : [0, 0, 1],
    a0: light.a0,
    radius: light.radius,
    versineInner: light.kind === "spot" ? versine(light.inner) : 3,
    versineOuter: light.kind === "spot" ? versine(light.outer) : 4,
    falloff: light.falloff === "inverse-square" ? 1 : 0,
  };
}

/** 1 - cos of an angle (rad), precise for small ones. */
export function versine(angle: number): number {
  return 2 * Math.sin(angle / 2) ** 2;
}
