/** One weight and color per light function for all lights together whose weights are the same for every receiver. */
import type { Asset } from "./asset";
import { inAssetFrame } from "./asset_frame";
import type { Light } from "./lights";

/**
 * (K, 3) of relighting maps, (C (S + 1), 3) of coefficient maps: `srbf.methods.projected_weights`. Of neural maps, whose lights are evaluated one by one,
 * (2, 512, 3): the directions to lights at infinity, and their colors. Point and spot lights on maps of directions are
 * left out, since their weights depend on the receiver: the shader computes them. `lights` are in the asset's world.
 */
export function projectedWeights(asset: Asset, lights: readonly Light[]): Float64Array {
  return asset.tables.projectedWeights(inAssetFrame(asset, lights));
}
