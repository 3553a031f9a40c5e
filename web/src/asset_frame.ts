/** Lights brought into the asset's frame: the one place where the package does it. */
import type { Asset } from "./asset";
import { environmentSamples } from "./environment";
import { isPunctual, type Light, moved, type PunctualLight } from "./lights";
import type { Triple } from "./matrix";

/** A unit direction from the surface to the light, in the asset's frame, and its irradiance. */
export type DistantLight = readonly [direction: Triple, color: Triple];

export interface LightsInAssetFrame {
  /** Directional lights and the texels of environments, made as they are asked for, once. */
  readonly distant: Iterable<DistantLight>;
  /** Point and spot lights. */
  readonly punctual: readonly PunctualLight[];
}

/** `lights` are in the asset's world. */
export function inAssetFrame(asset: Pick<Asset, "manifest" | "assetFromWorld">, lights: readonly Light[]): LightsInAssetFrame {
  const { assetFromWorld, manifest } = asset;
  function* distant(): Generator<DistantLight> {
    for (const light of lights) {
      if (light.kind === "directional") yield [moved(light, assetFromWorld).direction, light.color];
      if (light.kind === "environment") yield* environmentSamples(light, manifest.domain, assetFromWorld);
    }
  }
  return { distant: distant(), punctual: lights.filter(isPunctual).map((light) => moved(light, assetFromWorld)) };
}
