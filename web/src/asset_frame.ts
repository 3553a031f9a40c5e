/** Lights brought into the asset's frame: the one place where the package does it. */
import type { Asset } from "./asset";
import { environmentSamples } from "./environment";
import { SrbfError } from "./errors";
import { type AreaLight, isPunctual, type Light, moved, type NamedLight, type PunctualLight } from "./lights";
import { lightDomainOf } from "./manifest";
import type { Triple } from "./matrix";

/** A unit direction from the surface to the light, in the asset's frame, and its irradiance. */
export type DistantLight = readonly [direction: Triple, color: Triple];

export interface LightsInAssetFrame {
  /** Directional lights and the texels of environments, made as they are asked for, once. */
  readonly distant: Iterable<DistantLight>;
  /** Point, spot and sphere lights. */
  readonly punctual: readonly PunctualLight[];
  readonly areas: readonly AreaLight[];
  /** The scene's own lights, or objects that emit. */
  readonly named: readonly NamedLight[];
}

const TAKEN = {
  directions: ["directional", "environment", "point", "spot", "sphere"],
  named: ["named"],
  cloud: ["point", "spot", "sphere", "area", "directional"],
  pool: ["point", "spot", "sphere", "area", "directional"],
  surfels: ["point", "spot", "sphere", "area", "directional", "named"],
} as const;

/** `lights` are in the asset's world. @throws SrbfError on kinds that the asset cannot be relit by. */
export function inAssetFrame(asset: Pick<Asset, "manifest" | "assetFromWorld">, lights: readonly Light[]): LightsInAssetFrame {
  const { assetFromWorld, manifest } = asset;
  const taken: readonly string[] = TAKEN[lightDomainOf(manifest)];
  const other = lights.find((light) => !taken.includes(light.kind));
  if (other) throw new SrbfError(`expected lights of ${taken.join(", ")} for this asset, found a ${other.kind} one; bake the scene with that light set`);
  function* distant(): Generator<DistantLight> {
    for (const light of lights) {
      if (light.kind === "directional") yield [moved(light, assetFromWorld).direction, light.color];
      if (light.kind === "environment") yield* environmentSamples(light, manifest.domain, assetFromWorld);
    }
  }
  return {
    distant: distant(),
    punctual: lights.filter(isPunctual).map((light) => moved(light, assetFromWorld)),
    areas: lights.filter((light) => light.kind === "area").map((light) => moved(light, assetFromWorld)),
    named: lights.filter((light) => light.kind === "named"),
  };
}
