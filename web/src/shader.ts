/** What every engine's shader of an asset is made of: its text, its defines, and the numbers that change with the lights. */
import type { Asset } from "./asset";
import { type PointLightUniforms, pointLightUniforms } from "./point_light";
import { isPunctual, type Light, moved } from "./lights";
import type { Method } from "./manifest";
import { SrbfError } from "./errors";
import clusteredEigenMap from "./shaders/clustered_eigen_map.glsl";
import eigenMap from "./shaders/eigen_map.glsl";
import relightingMap from "./shaders/relighting_map.glsl";
import { projectedWeights } from "./weights";

const SOURCES: Record<Method, string> = {
  "relighting-map": relightingMap,
  "eigen-map": eigenMap,
  "clustered-eigen-map": clusteredEigenMap,
};

/** Numbers of a frame: `weights` is vec4 after vec4, K of relighting maps, C rows of S + 1 of eigen maps. */
export interface FrameValues {
  readonly weights: Float32Array;
  readonly pointLights: readonly PointLightUniforms[];
}

/** The frame's numbers under `lights`, which are in the asset's world. @throws SrbfError on lamps where the asset does not know where its receivers are. */
export function frameValues(asset: Asset, lights: readonly Light[]): FrameValues {
  const projected = projectedWeights(asset, lights, asset.assetFromWorld);
  const weights = new Float32Array((projected.length / 3) * 4);
  for (let i = 0, j = 0; i < projected.length; i += 3, j += 4) weights.set([projected[i], projected[i + 1], projected[i + 2]], j);
  const pointLights = lights.filter(isPunctual).map((light) => pointLightUniforms(moved(light, asset.assetFromWorld)));
  return { weights, pointLights };
}

/** @throws SrbfError where lamps need a position map and the asset has none. */
export function needPositions(asset: Asset, pointLights: number): void {
  if (pointLights > 0 && !asset.position) {
    throw new SrbfError("point and spot lights need a position map, and this asset has none; relight it by directional lights");
  }
}

/**
 * GLSL that declares an asset's uniforms and `vec3 srbfRelit(vec2 uv, float level, vec3 receiver)`: uv with v downwards, receiver in the asset's frame,
 * meters, `room` for lamps. `srbfRelitSurface(uv, receiver)` finds the level of mip maps itself.
 */
export function shaderText(asset: Asset, room: number): string {
  const lines = Object.entries(shaderDefines(asset, room)).map(([name, value]) => `#define ${name} ${value}`);
  return [...lines, shaderBody(asset)].join("\n");
}

/** `shaderText` without its defines, for engines that write those themselves. */
export function shaderBody(asset: Asset): string {
  return SOURCES[asset.manifest.method];
}

export function shaderDefines(asset: Asset, room: number): Record<string, number> {
  const own: Record<string, number> =
    asset.basis.kind === "gaussian" ? { SRBF_K: asset.layers.count } : { SRBF_COMPONENTS: asset.basis.scalars, SRBF_LAYERS: asset.layers.count };
  return { ...own, SRBF_POINT_LIGHTS: room };
}

/** vec4 of uniforms that the fragment shader of an asset needs, without the engine's own. */
export function uniformVectors(asset: Asset, room: number): number {
  return (asset.basis.kind === "gaussian" ? 4 : 2) * asset.layers.count + 4 * room;
}

/** Centers as vec4, w = 0. */
export function paddedCenters(asset: Asset): Float32Array {
  if (asset.basis.kind !== "gaussian") return new Float32Array(0);
  return new Float32Array(asset.basis.centers.flatMap((center) => [...center, 0]));
}
