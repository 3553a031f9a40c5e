/** Scalar coefficient maps, four per layer, that are summed under projected weights alone: the cost per texel is the same for any number of lights. */
import { SrbfError } from "./errors";
import type { AssetFiles } from "./files";
import { type ByteImage, checkSize } from "./image";
import { checkLightValues, type LightValuesManifest } from "./light_values";
import type { Fail, Method, Tables } from "./methods/method";
import type { NodeKit } from "./methods/node_kit";
import { decodePng } from "./png";
import shader from "./shaders/weighted_components.glsl";
import type { N } from "./three/tsl/nodes";

/** Keys of asset.json. A cluster has `scalars` + 1 functions: that of the mean, and one per component. */
export interface ComponentsManifest extends LightValuesManifest {
  scalars?: number;
  clusters?: number;
  cluster_index?: { file: string };
}

/** What methods of weighted components share. */
export const WEIGHTED_COMPONENTS = {
  layersKey: "planes",
  layerChannels: 4,
  mapsPerLayer: 4,
  mapsName: "components",
  filterable: (manifest: ComponentsManifest) => !manifest.cluster_index, // a component means something else in the next cluster
  shader,
} as const satisfies Partial<Method>;

export function checkWeightedComponents(manifest: ComponentsManifest, layers: number, fail: Fail): void {
  const { scalars, clusters = 1 } = manifest;
  if (!(Number.isInteger(scalars) && Math.ceil((scalars as number) / 4) === layers)) fail("scalars four to an image", scalars);
  if (!(Number.isInteger(clusters) && clusters >= 1 && clusters <= 256)) fail("1 to 256 clusters", clusters);
  if (clusters > 1 && !manifest.cluster_index) fail("a cluster_index", undefined);
  checkLightValues(manifest, fail);
}

/** Number of functions that an asset's lights are projected on. */
export const functionsOf = ({ scalars = 0, clusters = 1 }: ComponentsManifest): number => clusters * (scalars + 1);

/** All tables but `projectedWeights` and what the domain of lights adds. */
export async function readWeightedComponents(files: AssetFiles, manifest: ComponentsManifest): Promise<Omit<Tables, "projectedWeights">> {
  const { scalars: components = 0, clusters = 1, cluster_index } = manifest;
  const index = cluster_index && (await readClusters(files, manifest, cluster_index.file));
  return {
    centers: [],
    maps: components,
    defines: { SRBF_COMPONENTS: components, SRBF_LAYERS: Math.ceil(components / 4), ...(index ? { SRBF_CLUSTERED: 1 } : {}) },
    vectors: {},
    integers: {},
    textures: index ? { srbfClusters: index } : {},
    weights: { kind: "texture", width: components + 1, height: clusters },
    sum(kit, uv) {
      const { int, ivec2, textureLoad } = kit.tsl;
      const weights = kit.texture("srbfWeights");
      const cluster = (index ? clusterAt(kit, uv) : int(0)).toVar();
      return combined(kit, uv, components, (j) => textureLoad(weights, ivec2(j, cluster)).rgb, "k");
    },
  };
}

/** The number of the cluster of every texel. @throws SrbfError on an image of another size, or of several channels. */
export async function readClusters(files: AssetFiles, manifest: ComponentsManifest, file: string): Promise<ByteImage> {
  const clusters = checkSize(decodePng(await files.bytes(file), file), manifest, file);
  if (clusters.channels !== 1) throw new SrbfError(`expected one channel in ${file}, found ${clusters.channels}`);
  return clusters;
}

/** A node of the number of the cluster at `uv`. */
export function clusterAt(kit: NodeKit, uv: N): N {
  const { int, textureLoad } = kit.tsl;
  return int(textureLoad(kit.texture("srbfClusters"), kit.texelAt(uv)).r.mul(255).add(0.5));
}

/** w_0 plus the sum over components of a_j w_j, `lightFunction` giving w_j; `loop` names the loop's counter. */
export function combined(kit: NodeKit, uv: N, components: number, lightFunction: (j: N) => N, loop: string): N {
  const response = lightFunction(kit.tsl.int(0)).toVar();
  kit.each(kit.layers, loop, (i) => {
    const values = kit.decoded(uv, i).toVar();
    [values.x, values.y, values.z, values.w].forEach((value, c) => {
      response.addAssign(lightFunction(kit.pack.least(i.mul(4).add(c + 1), components)).mul(value)); // an unused channel is 0 and takes the last weight
    });
  });
  return response;
}
