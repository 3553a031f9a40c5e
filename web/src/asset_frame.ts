/** Lights brought into the asset's frame: the one place where the package does it. */
import type { Asset } from "./asset";
import { environmentSamples } from "./environment";
import { SrbfError } from "./errors";
import { type AreaLight, type EnvironmentLight, isPunctual, type Light, moved, type NamedLight, type PunctualLight } from "./lights";
import { lightDomainOf } from "./manifest";
import type { Matrix4, Triple } from "./matrix";
import { type EnvironmentDirections, environmentDirections } from "./environment_directions";

/** A unit direction from the surface to the light, in the asset's frame, and its irradiance. */
export type DistantLight = readonly [direction: Triple, color: Triple];

export interface LightsInAssetFrame {
  /** Directional lights. */
  readonly suns: readonly DistantLight[];
  /** Of assets of directions, the texels of environments, made as they are asked for, once. */
  readonly texels: Iterable<DistantLight>;
  /** Both. */
  readonly distant: Iterable<DistantLight>;
  /** Environments around lights inside a scene, in the asset's world. */
  readonly environments: readonly EnvironmentLight[];
  /** Environments around a pool of surfels, as distant lights. */
  readonly environmentDirections: readonly EnvironmentDirections[];
  readonly assetFromWorld: Matrix4;
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
  pool: ["point", "spot", "sphere", "area", "directional", "environment"],
  surfels: ["point", "spot", "sphere", "area", "directional", "environment", "named"],
} as const;

/** `lights` are in the asset's world. @throws SrbfError on kinds that the asset cannot be relit by. */
export function inAssetFrame(asset: Pick<Asset, "manifest" | "assetFromWorld">, lights: readonly Light[]): LightsInAssetFrame {
  const { assetFromWorld, manifest } = asset;
  const domain = lightDomainOf(manifest);
  const taken: readonly string[] = TAKEN[domain];
  const other = lights.find((light) => !taken.includes(light.kind));
  if (other) throw new SrbfError(`expected lights of ${taken.join(", ")} for this asset, found a ${other.kind} one; bake the scene with that light set`);
  if (domain === "directions" && lights.some((light) => isPunctual(light) && light.profile)) {
    throw new SrbfError("expected lights without a profile for this asset, found one; capture the scene with --light-set surfels or gather");
  }
  const suns = lights.filter((light) => light.kind === "directional").map((light): DistantLight => [moved(light, assetFromWorld).direction, light.color]);
  function* environmentTexels(): Generator<DistantLight> {
    for (const light of lights) if (light.kind === "environment" && domain === "directions") yield* environmentSamples(light, manifest.domain, assetFromWorld);
  }
  const texels = environmentTexels();
  function* distant(): Generator<DistantLight> {
    yield* suns;
    yield* texels;
  }
  return {
    suns,
    texels,
    distant: distant(),
    environments: domain === "directions" || domain === "pool" ? [] : lights.filter((light) => light.kind === "environment"),
    environmentDirections: domain === "pool" ? lights.filter((light) => light.kind === "environment").map((light) => environmentDirections(light, assetFromWorld)) : [],
    assetFromWorld,
    punctual: lights.filter(isPunctual).map((light) => moved(light, assetFromWorld)),
    areas: lights.filter((light) => light.kind === "area").map((light) => moved(light, assetFromWorld)),
    named: lights.filter((light) => light.kind === "named"),
  };
}
