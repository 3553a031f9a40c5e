/** Weights of lights inside a scene that the GPU computes, whatever the method. */
import type { Texture, WebGLRenderer } from "three";
import type { Asset } from "../asset";
import { SrbfError } from "../errors";
import type { Triple } from "../matrix";
import type { ShapeLights } from "../shape_weights";
import type { ShadowedLook } from "./engine_shadows";
import { GatherWeights } from "./gather_weights";
import { SurfelWeights } from "./surfel_weights";

export interface GpuWeights {
  /** What looks are less, meters. */
  readonly middle: Triple;
  /** The weights, as the shaders of the asset take them. */
  readonly weights: Texture;
  /** Draw the weights under lights, each a list of looks; within `undisturbed`. */
  draw(renderer: WebGLRenderer, lights: readonly (readonly ShadowedLook[])[]): void;
  /** Take the objects that emit, and environments. @throws SrbfError where there are some that the asset does not know. */
  setShapes(lights: ShapeLights): void;
  dispose(): void;
}

/** @throws SrbfError on an asset whose lights the GPU cannot follow. */
export function gpuWeights(asset: Asset, shadowSize?: number): GpuWeights {
  return asset.tables.gather ? new GatherWeights(asset.tables.gather, shadowSize) : new SurfelWeights(asset, shadowSize);
}

/** @throws SrbfError where the GPU cannot draw floats. */
export function checkDrawsFloats(renderer: WebGLRenderer): void {
  if (renderer.extensions.has("EXT_color_buffer_float")) return;
  throw new SrbfError('expected a GPU that draws into floating-point textures for weights "gpu", found one without EXT_color_buffer_float; take weights: "cpu"');
}
