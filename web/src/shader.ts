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

/** The frame's numbers under `lights`, which are in the asset's world. */
export function frameValues(asset: Asset, lights: readonly Light[]): FrameValues {
  const { distant, punctual } = inAssetFrame(asset, lights);
  const projected = asset.tables.projectedWeights(distant);
  const weights = new Float32Array((projected.length / 3) * 4);
  for (let i = 0, j = 0; i < projected.length; i += 3, j += 4) weights.set([projected[i], projected[i + 1], projected[i + 2]], j);
  return { weights, pointLights: punctual.map(pointLightUniforms) };
}

/** @throws SrbfError where point lights need a position map and the asset has none. */
export function needPositions(asset: Asset, pointLights: number): void {
  if (pointLights > 0 && !asset.position) {
    throw new SrbfError("point and spot lights need a position map, and this asset has none; relight it by directional lights");
  }
}

/** @throws SrbfError for an `engine` whose materials sum filtered layers, on a method whose layers must not be filtered. */
export function needFilterable(asset: Asset, engine: string): void {
  if (!asset.method.filterable) {
    throw new SrbfError(`expected maps that ${engine} may filter, found ${asset.method.name}; fit another method, or use srbf/three`);
  }
}

/**
 * GLSL that declares an asset's uniforms and `vec3 srbfRelit(vec2 uv, float level, vec3 receiver)`: uv with v downwards, receiver in the asset's frame,
 * meters, `room` for point lights. `srbfRelitSurface(uv, receiver)` finds the mip level itself.
 */
export function shaderText(asset: Asset, room: number): string {
  const lines = Object.entries(shaderDefines(asset, room)).map(([name, value]) => `#define ${name} ${value}`);
  return [...lines, shaderBody(asset)].join("\n");
}

/** `shaderText` without its defines, for engines that write those themselves. */
export function shaderBody(asset: Asset): string {
  return asset.method.shader;
}

export function shaderDefines(asset: Asset, room: number): Record<string, number> {
  return { ...asset.tables.defines, SRBF_POINT_LIGHTS: room };
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
