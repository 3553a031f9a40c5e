/** Light mixing without loss: an RGB map for each of the scene's own lights, weighted by its color. */
import type { AssetFiles } from "../files";
import { checkNames, colorsOf, type NamedManifest, namesOf } from "../named_lights";
import shader from "../shaders/named_maps.glsl";
import type { N } from "../three/tsl/nodes";
import type { Fail, Method, Tables } from "./method";
import type { NodeKit } from "./node_kit";

export const namedMaps: Method = {
  name: "named-maps",
  layersKey: "maps",
  layerChannels: 3,
  mapsPerLayer: 1,
  mapsName: "maps",
  filterable: () => true,
  shader,

  check(manifest: NamedManifest, layers: number, fail: Fail): void {
    checkNames(manifest, fail);
    if (manifest.lights?.length !== layers) fail("as many lights as maps", manifest.lights?.length);
  },

  async read(_: AssetFiles, manifest: NamedManifest): Promise<Tables> {
    const names = namesOf(manifest);
    return {
      names,
      centers: [],
      maps: names.length,
      defines: { SRBF_K: names.length },
      vectors: {},
      integers: {},
      textures: {},
      weights: { kind: "texture", width: names.length, height: 1 },
      projectedWeights: ({ named }) => colorsOf(names, named),
      sum,
    };
  },
};

function sum(kit: NodeKit, uv: N): N {
  const { ivec2, textureLoad, vec3 } = kit.tsl;
  const total = vec3(0).toVar();
  const weights = kit.texture("srbfWeights");
  kit.each(kit.layers, "k", (k) => total.addAssign(kit.decoded(uv, k).rgb.mul(textureLoad(weights, ivec2(k, 0)).rgb)));
  return total;
}
