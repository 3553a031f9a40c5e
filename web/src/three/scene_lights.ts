/** three.js lights as lights of the library, in three's world. */
import { type DirectionalLight, type Light as ThreeLight, type PointLight, type RectAreaLight, type SpotLight, Vector3 } from "three";
import { SrbfError } from "../errors";
import { areaLight, directionalLight, type Light, pointLight, spotLight } from "../lights";
import type { Triple } from "../matrix";

export type SceneLight = DirectionalLight | PointLight | SpotLight | RectAreaLight;

/**
 * A three.js light as a light of the library, in three's own units: a directional light's color * intensity (lux) is the irradiance; a point or spot light's (candela)
 * is the irradiance at 1 m. `decay` 2 is inverse-square down to 0.1 m, where three stops it, 1 is linear down to 0.01 m. A spot is full inside
 * angle * (1 - penumbra) and ends at angle. A RectAreaLight's color * intensity (nit) is its radiance, towards its own -z. Invisible lights are left out.
 *
 * @throws SrbfError on another kind of light, a decay that is neither 1 nor 2, or a `distance` that cuts the light off.
 */
export function lightOf(light: SceneLight): Light | undefined {
  if (!light.visible) return undefined;
  light.updateWorldMatrix(true, false);
  const color = triple(light.color.clone().multiplyScalar(light.intensity).toArray());
  const place = new Vector3().setFromMatrixPosition(light.matrixWorld);
  if (isDirectional(light)) return directionalLight(triple(place.sub(target(light)).toArray()), color);
  if (isArea(light)) {
    const [side, up] = [new Vector3(), new Vector3()];
    light.matrixWorld.extractBasis(side, up, new Vector3());
    const area = light.width * side.length() * light.height * up.length();
    const sides = [up.multiplyScalar(light.height), side.multiplyScalar(light.width)].map((v) => triple(v.toArray()));
    return areaLight(triple(place.toArray()), sides[0], sides[1], { color: triple(color.map((x) => x * area)) });
  }
  const fade = { color, ...falloffOf(light) };
  if (isSpot(light)) {
    const axis = triple(target(light).sub(place).toArray());
    return spotLight(triple(place.toArray()), axis, { inner: light.angle * (1 - light.penumbra), outer: light.angle }, fade);
  }
  return pointLight(triple(place.toArray()), fade);
}

/** @throws SrbfError where an asset cannot be relit by lights of this kind. */
export function checkKind(light: ThreeLight): asserts light is SceneLight {
  const known = light as Partial<Record<"isDirectionalLight" | "isPointLight" | "isSpotLight" | "isRectAreaLight", boolean>>;
  if (!(known.isDirectionalLight || known.isPointLight || known.isSpotLight || known.isRectAreaLight)) {
    throw new SrbfError(`expected a DirectionalLight, PointLight, SpotLight or RectAreaLight to follow, found ${light.type}; add others to lights yourself`);
  }
}

function falloffOf(light: PointLight | SpotLight): { falloff: "linear" | "inverse-square"; radius: number } {
  if (light.distance !== 0) {
    throw new SrbfError(`expected a light of distance 0 (no cut-off), found ${light.distance}; set ${light.type}.distance = 0`);
  }
  if (light.decay === 2) return { falloff: "inverse-square", radius: 0.1 };
  if (light.decay === 1) return { falloff: "linear", radius: 0.01 };
  throw new SrbfError(`expected a decay of 2 (inverse-square) or 1 (linear), found ${light.decay}; set ${light.type}.decay`);
}

function target(light: DirectionalLight | SpotLight): Vector3 {
  light.target.updateWorldMatrix(true, false);
  return new Vector3().setFromMatrixPosition(light.target.matrixWorld);
}

function isDirectional(light: SceneLight): light is DirectionalLight {
  return (light as DirectionalLight).isDirectionalLight === true;
}

export function isArea(light: SceneLight): light is RectAreaLight {
  return (light as RectAreaLight).isRectAreaLight === true;
}

function isSpot(light: SceneLight): light is SpotLight {
  return (light as SpotLight).isSpotLight === true;
}

function triple(numbers: readonly number[]): Triple {
  return [numbers[0], numbers[1], numbers[2]];
}
