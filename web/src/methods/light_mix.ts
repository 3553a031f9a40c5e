/** Light mixing: coefficient maps whose functions are known at each of the scene's own lights, which are dimmed and recolored by name. */
import type { AssetFiles } from "../files";
import { readLightValues, summed } from "../light_values";
import { checkNames, colorsOf, type NamedManifest, namesOf } from "../named_lights";
import { checkWeightedComponents, type ComponentsManifest, functionsOf, readWeightedComponents, WEIGHTED_COMPONENTS } from "../weighted_components";
import type { Fail, Method, Tables } from "./method";

type LightMixManifest = ComponentsManifest & NamedManifest;

export const lightMix: Method = {
  name: "light-mix",
  ...WEIGHTED_COMPONENTS,

  check(manifest: LightMixManifest, layers: number, fail: Fail): void {
    checkWeightedComponents(manifest, layers, fail);
    checkNames(manifest, fail);
  },

  async read(files: AssetFiles, manifest: LightMixManifest): Promise<Tables> {
    const names = namesOf(manifest);
    const [parts, values] = await Promise.all([readWeightedComponents(files, manifest), readLightValues(files, manifest, functionsOf(manifest), names.length)]);
    return { ...parts, names, projectedWeights: ({ named }) => summed(values, colorsOf(names, named)) };
  },
};
