/** What lights add to the weights of a transfer asset's shapes without light on its surfels: objects that emit, and environments. */
import type { LightsInAssetFrame } from "./asset_frame";
import { SrbfError } from "./errors";
import type { Tables } from "./methods/method";
import { changeable } from "./surface_changes";

export type ShapeLights = Pick<LightsInAssetFrame, "named" | "environments" | "assetFromWorld">;

const numbers = new WeakMap<object, number>(); // of the pixels of environments that were asked for
let last = 0;

/** What `shapeWeights` depend on, of one asset whose albedo stays. */
export function shapeState({ named, environments, assetFromWorld }: ShapeLights): string {
  return JSON.stringify([named, environments.map(({ pixels, color, turn }) => [numberOf(pixels as object), color, turn]), environments.length ? assetFromWorld : 0]);
}

function numberOf(pixels: object): number {
  const number = numbers.get(pixels) ?? ++last;
  numbers.set(pixels, number);
  return number;
}

/** (r, 3); undefined where there are none of these lights. @throws SrbfError where the asset does not know their like. */
export function shapeWeights({ surfaces, environment }: Pick<Tables, "surfaces" | "environment">, { named, environments, assetFromWorld }: ShapeLights): Float64Array | undefined {
  if (!named.length && !environments.length) return undefined;
  if (environments.length && !environment) throw new SrbfError("expected an asset whose surfels see an environment, with environment_transfer, found one without: its scene is closed, or the asset is older; bake and fit again");
  if (environments.length && surfaces?.change) throw new SrbfError("expected the albedo of the bake under an environment, found objects that are repainted; give them their own albedo");
  const parts = environments.map((light) => (environment as NonNullable<typeof environment>).weights(light, assetFromWorld));
  if (named.length) parts.push(changeable(surfaces).emission(named));
  return parts.reduce((sum, part) => sum.map((weight, i) => weight + part[i]));
}
