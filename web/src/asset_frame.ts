/** Lights brought into the asset's frame: the one place where the package does it. */
import type { Asset } from "./asset";
import { SrbfError } from "./errors";
import { isLinked, type Links, linksOf } from "./light_linking";
import { type AreaLight, type EnvironmentLight, isPunctual, type Light, moved, type NamedLight, type PunctualLight } from "./lights";
import { type LightDomain, lightDomainOf } from "./manifest";
import type { Matrix4, Triple } from "./matrix";
import type { GatherManifest } from "./gather";
import { type EnvironmentDirections, environmentDirections } from "./environment_directions";

/** A unit direction from the surface to the light, in the asset's frame, its irradiance, and what it chooses of the scene's objects. */
export type DistantLight = readonly [direction: Triple, color: Triple, links?: Links];

export interface LightsInAssetFrame {
  readonly distant: readonly DistantLight[];
  /** In the asset's world, but around a pool of surfels. */
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
  checkLinks(manifest, domain, lights);
  const maps = lights.filter((light) => light.kind === "environment");
  return {
    distant: lights
      .filter((light) => light.kind === "directional")
      .map((light) => {
        const { direction, color } = moved(light, assetFromWorld);
        return isLinked(light) ? [direction, color, linksOf(light)] : [direction, color];
      }),
    environments: domain === "pool" ? [] : maps,
    environmentDirections: domain === "pool" ? maps.map((light) => environmentDirections(light, assetFromWorld)) : [],
    assetFromWorld,
    punctual: lights.filter(isPunctual).map((light) => moved(light, assetFromWorld)),
    areas: lights.filter((light) => light.kind === "area").map((light) => moved(light, assetFromWorld)),
    named: lights.filter((light) => light.kind === "named"),
  };
}

/** @throws SrbfError where lights choose objects of an asset that does not know them. */
function checkLinks(manifest: GatherManifest, domain: LightDomain, lights: readonly Light[]): void {
  if (!lights.some((light) => isLinked(light as Links))) return;
  if (domain !== "pool") throw new SrbfError("expected lights without receivers and blockers for this asset, found one with them; capture the view with --light-set gather");
  if (!manifest.gather?.objects?.length) throw new SrbfError("expected an asset that knows its objects for a light with receivers or blockers, found one of an older bake; bake again, and fit");
}
