/** three.js' own shadow maps in its node language, for the direct light on cells of the surfaces: as its materials look them up, without their blur. */
import { type DepthTexture, Matrix4, type PerspectiveCamera, type PointLight, Vector2 } from "three";
import * as tsl from "three/tsl";
import type { Renderer } from "three/webgpu";
import type { Triple } from "../../matrix";
import { type EngineShadow, sceneFromCell } from "../engine_shadows";
import type { N } from "./nodes";
import type { Visibility } from "./surfel_irradiance";

const { abs, cubeTexture, float, If, max, mix, normalize, select, texture, uniform, vec2, vec4 } = tsl as Record<string, N>;

/** Uniforms of an engine's shadow. */
export function shadowUniforms() {
  return { fromCell: uniform(new Matrix4()), matrix: uniform(new Matrix4()), depths: uniform(new Vector2()), bias: uniform(0), normalBias: uniform(0), intensity: uniform(1) } as Record<string, N>;
}

export function setShadow(u: Record<string, N>, { light, sceneFromAsset }: EngineShadow, middle: Triple): void {
  const { shadow } = light;
  const { near, far } = shadow.camera as PerspectiveCamera;
  u.fromCell.value.copy(sceneFromCell(sceneFromAsset, middle));
  u.matrix.value.copy(shadow.matrix);
  u.depths.value.set(near, far);
  for (const name of ["bias", "normalBias", "intensity"] as const) u[name].value = shadow[name];
}

/** The map of a light's shadow: of depths. */
export const depthsOf = ({ light }: EngineShadow): DepthTexture => light.shadow.map?.depthTexture as DepthTexture;

/** How much of the light a cell sees by `depths`. */
export function seenInMap(u: Record<string, N>, shadow: EngineShadow, depths: DepthTexture, renderer: Renderer): Visibility {
  const reversed = renderer.reversedDepthBuffer === true;
  const compared = (at: N, depth: N): N => {
    if (depths.compareFunction) return at.compare(depth);
    return select(reversed ? depth.greaterThanEqual(at.r) : depth.lessThanEqual(at.r), float(1), float(0)); // VSM keeps them plain
  };
  return (place, normal) => {
    const facing = normalize(u.fromCell.mul(vec4(normal, 0)).xyz);
    const at = u.matrix.mul(vec4(u.fromCell.mul(vec4(place, 1)).xyz.add(facing.mul(u.normalBias)), 1)).toVar();
    const lit = float(1).toVar();
    if ((shadow.light as PointLight).isPointLight) {
      const size = abs(at.xyz).toVar();
      const z = max(max(size.x, size.y), size.z).toVar();
      const depth = u.depths.y.mul(z.sub(u.depths.x)).div(z.mul(u.depths.y.sub(u.depths.x)));
      If(z.greaterThanEqual(u.depths.x).and(z.lessThanEqual(u.depths.y)), () => {
        lit.assign(compared(cubeTexture(depths, normalize(at.xyz)), reversed ? depth.oneMinus().sub(u.bias) : depth.add(u.bias)));
      });
    } else {
      const coordinates = at.xyz.div(at.w).toVar();
      const depth = reversed ? coordinates.z.sub(u.bias) : coordinates.z.add(u.bias);
      const inside = at.w.greaterThan(0).and(coordinates.x.greaterThanEqual(0)).and(coordinates.x.lessThanEqual(1)).and(coordinates.y.greaterThanEqual(0)).and(coordinates.y.lessThanEqual(1));
      If(inside.and(depth.lessThanEqual(1)), () => {
        lit.assign(compared(texture(depths, vec2(coordinates.x, coordinates.y.oneMinus())), depth));
      });
    }
    return mix(float(1), lit, u.intensity);
  };
}
