/** The uniforms of `shaderText` as three.js has them; every material and pass of an asset shares these objects. */
import { type IUniform, Matrix4 } from "three";
import type { Asset } from "../asset";
import { pointLightRoom, packedPointLights } from "../point_light";
import { constantVectors, type FrameValues } from "../shader";
import type { SrbfTextures } from "./textures";

export type Uniforms = Record<string, IUniform>;

/** Uniforms that hold the asset, without lights. */
export function assetUniforms(asset: Asset, textures: SrbfTextures): Uniforms {
  const uniforms: Uniforms = {
    srbfLayers: { value: textures.layers },
    srbfAmbient: { value: textures.ambient },
    srbfPointLights: { value: packedPointLights([], 1) },
    srbfPointLightCount: { value: 0 },
    srbfAssetFromScene: { value: new Matrix4() },
  };
  if (textures.alpha) uniforms.srbfAlpha = { value: textures.alpha };
  if (textures.positions) uniforms.srbfPositions = { value: textures.positions };
  uniforms.srbfWeights = { value: textures.weights ?? new Float32Array(4 * asset.tables.weights.width) };
  for (const [name, value] of Object.entries({ ...constantVectors(asset), ...asset.tables.integers, ...textures.tables })) uniforms[name] = { value };
  return uniforms;
}

/** Write the numbers of one frame. */
export function setFrame(uniforms: Uniforms, textures: SrbfTextures, frame: FrameValues): void {
  if (textures.weights) {
    (textures.weights.image.data as Float32Array).set(frame.weights);
    textures.weights.needsUpdate = true;
  } else {
    (uniforms.srbfWeights.value as Float32Array).set(frame.weights);
  }
  uniforms.srbfPointLights.value = packedPointLights(frame.pointLights, pointLightRoom(frame.pointLights.length));
  uniforms.srbfPointLightCount.value = frame.pointLights.length;
}
