/** three.js' own shadow maps, for the direct light on cells of the surfaces. */
import { type DirectionalLight, type Matrix4, type PerspectiveCamera, type PointLight, type SpotLight, Vector2, VSMShadowMap, type WebGLRenderer } from "three";
import type { Triple } from "../matrix";
import type { Look } from "../surfels";
import { isArea, type SceneLight } from "./scene_lights";

/** A renderer of either kind. */
export interface Shadowing {
  shadowMap: { enabled: boolean };
}

/** A light of three's with a shadow, and where the asset lies in its world. */
export interface EngineShadow {
  readonly light: PointLight | SpotLight | DirectionalLight;
  readonly sceneFromAsset: Matrix4;
}

/** A point of a light, and the engine's shadow of it; without, the asset's own triangles cast one. */
export interface ShadowedLook extends Look {
  readonly shadow?: EngineShadow;
}

/** The shadow that three has drawn of a light, if it casts one; drawn with the last frame, so the first has none. */
export function engineShadow(light: SceneLight, renderer: Shadowing, sceneFromAsset: () => Matrix4): EngineShadow | undefined {
  if (isArea(light) || !light.castShadow || !renderer.shadowMap.enabled || !light.shadow.map) return undefined;
  return { light, sceneFromAsset: sceneFromAsset() };
}

/** Equal of the looks of lights that differ in color alone; undefined where an engine's shadow may have changed. */
export function keyOf(looks: readonly ShadowedLook[]): string | undefined {
  return looks.some(({ shadow }) => shadow) ? undefined : JSON.stringify(looks.map((look) => ({ ...look, color: 1 })));
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
      sceneFromCell: sceneFromCell(sceneFromAsset, middle),
    },
  };
}

/** To three's world from places less `middle`. */
export function sceneFromCell(sceneFromAsset: Matrix4, middle: Triple): Matrix4 {
  return sceneFromAsset.clone().multiply(sceneFromAsset.clone().makeTranslation(...middle));
}
