/** three.js' own shadow maps, for the direct light on cells of the surfaces. */
import { type DirectionalLight, type Matrix4, type PerspectiveCamera, type PointLight, type SpotLight, Vector2, VSMShadowMap, type WebGLRenderer } from "three";
import type { Triple } from "../matrix";
import { isArea, type SceneLight } from "./scene_lights";

/** A light of three's with a shadow, and where the asset lies in its world. */
export interface EngineShadow {
  readonly light: PointLight | SpotLight | DirectionalLight;
  readonly sceneFromAsset: Matrix4;
}

/** The shadow that three has drawn of a light, if it casts one; drawn with the last frame, so the first has none. */
export function engineShadow(light: SceneLight, renderer: WebGLRenderer, sceneFromAsset: () => Matrix4): EngineShadow | undefined {
  if (isArea(light) || !light.castShadow || !renderer.shadowMap.enabled || !light.shadow.map) return undefined;
  return { light, sceneFromAsset: sceneFromAsset() };
}

/** Defines and uniforms of surfel_irradiance.glsl. */
export function shadowUniforms(renderer: WebGLRenderer, { light, sceneFromAsset }: EngineShadow, middle: Triple): { defines: Record<string, number>; values: Record<string, unknown> } {
  const { shadow } = light;
  const cube = (light as PointLight).isPointLight === true;
  const map = shadow.map as NonNullable<typeof shadow.map>;
  const mean = renderer.shadowMap.type === VSMShadowMap;
  const texture = mean ? map.texture : (map.depthTexture ?? map.texture);
  const compares = !mean && map.depthTexture?.compareFunction != null;
  const { near, far } = shadow.camera as PerspectiveCamera;
  return {
    defines: { SRBF_SHADOW: compares ? 2 : 3, ...(cube ? { SRBF_CUBE: 1 } : {}), ...(renderer.state.buffers.depth.getReversed() ? { SRBF_REVERSED: 1 } : {}) },
    values: {
      shadowMap: texture,
      shadowMatrix: shadow.matrix,
      shadowBias: shadow.bias,
      shadowNormalBias: shadow.normalBias,
      shadowIntensity: shadow.intensity,
      shadowDepths: new Vector2(near, far),
      sceneFromCell: sceneFromAsset.clone().multiply(sceneFromAsset.clone().makeTranslation(...middle)),
    },
  };
}
