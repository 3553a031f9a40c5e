/** Clustered eigen maps: scalar coefficient maps whose light functions depend on the cluster that a texel belongs to. */
import { checkCoefficientMaps, readCoefficientMaps } from "../coefficient_maps";
import type { AssetFiles } from "../files";
import type { Manifest } from "../manifest";
import shader from "../shaders/clustered_eigen_map.glsl";
import { clusterAt, readClusters } from "../weighted_components";
import type { Fail, Method, Tables } from "./method";

/** Keys of asset.json that this method adds to those of coefficient maps. */
interface ClusteredManifest extends Manifest {
  cluster_index?: { file: string };
}

export const clusteredEigenMap: Method = {
  name: "clustered-eigen-map",
  layersKey: "planes",
  layerChannels: 4,
  mapsPerLayer: 4,
  mapsName: "components",
  filterable: () => false, // a component means something else in the next cluster
  shader,

  check(manifest: ClusteredManifest, layers: number, fail: Fail): void {
    checkCoefficientMaps(manifest, layers, fail);
    if (!manifest.cluster_index) fail("a cluster_index", undefined);
  },

  async read(files: AssetFiles, manifest: ClusteredManifest): Promise<Tables> {
    const { file } = manifest.cluster_index as { file: string };
    const clusters = await readClusters(files, manifest, file);
    const tables = await readCoefficientMaps(files, manifest, clusterAt);
    return { ...tables, textures: { ...tables.textures, srbfClusters: clusters } };
  },
};
