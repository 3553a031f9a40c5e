/** One weight a map, or a light function, and color for all directional and environment lights together. */
import type { Asset } from "./asset";
import { environmentSamples } from "./environment";
import { lookup } from "./gaussian";
import { foldFunctions } from "./light_functions";
import { type Light, unit } from "./lights";
import { dot, type Matrix4, type Triple, turned } from "./matrix";

/**
 * (K, 3) of relighting maps, (C (S + 1), 3) of eigen maps: what `srbf.methods.projected_weights` gives. Lamps are left out: shaders weigh them a
 * receiver at a time. Lights are in the world from which `assetFromWorld` leads to the asset's frame.
 */
export function projectedWeights(asset: Asset, lights: readonly Light[], assetFromWorld: Matrix4): Float64Array {
  const { basis } = asset;
  if (basis.kind === "light-functions") {
    const projected = new Float64Array(3 * basis.functions.spreads.length);
    foldFunctions(basis.functions, distantLights(asset, lights, assetFromWorld), projected);
    return projected;
  }
  const projected = new Float64Array(3 * basis.centers.length);
  for (const [direction, color] of distantLights(asset, lights, assetFromWorld)) {
    for (let k = 0; k < basis.centers.length; ++k) {
      const weight = lookup(basis.table, dot(direction, basis.centers[k]));
      for (let c = 0; c < 3; ++c) projected[3 * k + c] += weight * color[c];
    }
  }
  return projected;
}

function* distantLights(asset: Asset, lights: readonly Light[], assetFromWorld: Matrix4): Generator<readonly [Triple, Triple]> {
  for (const light of lights) {
    if (light.kind === "directional") yield [unit(turned(assetFromWorld, light.direction)), light.color];
    if (light.kind === "environment") yield* environmentSamples(light, asset.manifest.domain, assetFromWorld);
  }
}
