/** Smooth RGB functions of light direction, combinations of dense spherical Gaussians: `srbf/basis/light_functions.py`. */
import type { DistantLight } from "./asset_frame";
import { gaussian } from "./gaussian";
import { dot, type Triple } from "./matrix";

/** F functions over B shared unit centers, each with its own spread (rad); `coefficients` is (F, B, 3), row by row. */
export interface LightFunctions {
  readonly centers: readonly Triple[];
  readonly spreads: readonly number[];
  readonly coefficients: Float32Array;
}

/** sum over lights of color * w_f(direction), added to `projected` (F, 3). */
export function addProjected(functions: LightFunctions, lights: Iterable<DistantLight>, projected: Float64Array): void {
  const { centers, spreads, coefficients } = functions;
  const distinct = [...new Set(spreads)];
  const b = centers.length;
  const gathered = distinct.map(() => new Float64Array(3 * b)); // color times R of every center, summed over the lights
  for (const [direction, color] of lights) {
    for (let i = 0; i < b; ++i) {
      const cosine = dot(direction, centers[i]);
      for (let s = 0; s < distinct.length; ++s) {
        const weight = gaussian(cosine, distinct[s]);
        for (let c = 0; c < 3; ++c) gathered[s][3 * i + c] += weight * color[c];
      }
    }
  }
  const index = new Map(distinct.map((spread, s) => [spread, gathered[s]]));
  for (let f = 0; f < spreads.length; ++f) {
    const sums = index.get(spreads[f]) as Float64Array;
    for (let i = 0; i < b; ++i) {
      for (let c = 0; c < 3; ++c) projected[3 * f + c] += coefficients[3 * (f * b + i) + c] * sums[3 * i + c];
    }
  }
}
