/** Direct light of a sun by one orthographic shadow map for each of several directions over its disc: the passes of `srbf/visibility/shadow_map.py`. */
import type { WebGLRenderer, WebGLRenderTarget } from "three";
import directFragment from "../../glsl/stages/direct.frag";
import shadowVertex from "../../glsl/stages/shadow.vert";
import heightFragment from "../../glsl/stages/shadow_height.frag";
import transmittanceFragment from "../../glsl/stages/shadow_transmittance.frag";
import type { DirectionalLight, Triple } from "../src";
import { cross, dot } from "../src/matrix";
import type { LightChoice } from "./linked_pixels";
import type { Caster } from "./shadow_casters";
import { type LitTexels, ShadowMaps } from "./shadow_maps";
import { across, discDirections } from "./sun_disc";

const SIZE = 2048; // texels per side of a shadow map
const NOTHING = -1e30; // height where no occluder is

export class SunShadows {
  private readonly frame = { across: { value: [0, 0, 0] }, up: { value: [0, 0, 0] }, toLight: { value: [0, 0, 0] }, low: { value: [0, 0] }, extent: { value: 1 } };
  private readonly maps: ShadowMaps;

  /** `bounds`: points, xyz, that the maps must hold; `angle` of the disc of suns that do not say their own, rad. */
  constructor(
    renderer: WebGLRenderer,
    lit: readonly LitTexels[],
    casters: readonly Caster[],
    private readonly bounds: Float32Array,
    private readonly angle: number,
  ) {
    const stages = { vertex: shadowVertex, height: heightFragment, transmittance: transmittanceFragment, direct: directFragment };
    this.maps = new ShadowMaps(renderer, lit, casters, stages, this.frame, SIZE, NOTHING);
  }

  /** Add the light of `sun`, in the asset's frame, to `sum`. */
  add(sum: WebGLRenderTarget, sun: DirectionalLight, choice: LightChoice): void {
    const suns = discDirections(sun.direction, sun.angle ?? this.angle);
    for (const direction of suns) {
      this.look(direction);
      this.maps.add(sum, sun.color.map((value) => value / suns.length) as unknown as Triple, choice);
    }
  }

  /** Set the square across the light that holds every point, and a hundredth more on every side. */
  private look(toLight: Triple): void {
    const right = across(toLight);
    const up = cross(toLight, right);
    const [least, most] = [[Infinity, Infinity], [-Infinity, -Infinity]];
    for (let i = 0; i < this.bounds.length; i += 3) {
      const point: Triple = [this.bounds[i], this.bounds[i + 1], this.bounds[i + 2]];
      [dot(point, right), dot(point, up)].forEach((flat, a) => {
        least[a] = Math.min(least[a], flat);
        most[a] = Math.max(most[a], flat);
      });
    }
    const extent = Math.max(most[0] - least[0], most[1] - least[1], 1e-6) * 1.02;
    const { frame } = this;
    frame.across.value = [...right];
    frame.up.value = [...up];
    frame.toLight.value = [...toLight];
    frame.low.value = [(least[0] + most[0] - extent) / 2, (least[1] + most[1] - extent) / 2];
    frame.extent.value = extent;
  }
}
