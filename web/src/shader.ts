/** The parts of every engine's shader of an asset: its text, its defines, and the numbers that change with the lights. */
import type { Asset } from "./asset";
import { inAssetFrame } from "./asset_frame";
import { SrbfError } from "./errors";
import type { Light } from "./lights";
import { type PointLightUniforms, pointLightUniforms } from "./point_light";

/** The numbers of one frame: `weights` is vec4 after vec4, one for each light function. */
export interface FrameValues {
  readonly weights: Float32Array;
  readonly pointLights: readonly PointLightUniforms[];
}

/** A frame whose weights are on the GPU already. */
export const NO_WEIGHTS: FrameValues = { weights: new Float32Array(0), pointLights: [] };

/** The frame's numbers under `lights`, which are in the asset's world. */
export function frameValues(asset: Asset, lights: readonly Light[]): FrameValues {
  const all = inAssetFrame(asset, lights);
  const projected = asset.tables.projectedWeights(all);
  const weights = new Float32Array((projected.length / 3) * 4);
  for (let i = 0, j = 0; i < projected.length; i += 3, j += 4) weights.set([projected[i], projected[i + 1], projected[i + 2]], j);
  return { weights, pointLights: asset.tables.projectsPunctual ? [] : all.punctual.map(pointLightUniforms) };
}

/** @throws SrbfError where point lights need a position map and the asset has none. */
export function needPositions(asset: Asset, pointLights: number): void {
  if (pointLights > 0 && !asset.position) {
    throw new SrbfError("point and spot lights need a position map, and this asset has none; relight it by directional lights");
  }
}

/**
 * GLSL that declares an asset's uniforms and `vec3 srbfRelit(vec2 uv, float level, vec3 receiver)`: uv with v downwards, receiver in the asset's frame,
 * meters, `room` for point lights. `srbfRelitSurface(uv, receiver)` finds the mip level itself; where layers must not be filtered, `filtered` mixes
 * the light of the four texels about the place.
 */
export function shaderText(asset: Asset, room: number, filtered = false): string {
  const lines = Object.entries(shaderDefines(asset, room, filtered)).map(([name, value]) => `#define ${name} ${value}`);
  return [...lines, shaderBody(asset)].join("\n");
}

/** `shaderText` without its defines, for engines that write those themselves. */
export function shaderBody(asset: Asset): string {
  return asset.method.shader;
}

export function shaderDefines(asset: Asset, room: number, filtered = false): Record<string, number> {
  return { ...asset.tables.defines, SRBF_POINT_LIGHTS: room, ...(filtered ? { SRBF_FILTERED: 1 } : {}) };
}

/** Uniform arrays of vec4 that never change, by name. */
export function constantVectors(asset: Asset): Record<string, Float32Array> {
  return { srbfScale: asset.scale, srbfBias: asset.bias, ...asset.tables.vectors };
}

/** vec4 of uniforms that the fragment shader of an asset needs, without the engine's own. */
export function uniformVectors(asset: Asset, room: number): number {
  const constant = Object.values(constantVectors(asset)).reduce((total, numbers) => total + numbers.length / 4, 0);
  const { kind, width } = asset.tables.weights;
  return constant + (kind === "uniform" ? width : 0) + 4 * room;
}
