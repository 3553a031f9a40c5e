/** What eigen maps and clustered ones share: scalar coefficient maps, four per layer, of smooth RGB light functions with an octahedral table. */
import { SrbfError } from "./errors";
import { decodeFloat, decodeHalf } from "./exr";
import type { AssetFiles } from "./files";
import { LightFunctions } from "./light_functions";
import type { Manifest } from "./manifest";
import type { Triple } from "./matrix";
import type { Fail, Tables } from "./methods/method";
import type { NodeKit } from "./methods/node_kit";
import type { N } from "./three/tsl/nodes";
import { combined } from "./weighted_components";

/** Keys of asset.json. A cluster has `scalars` + 1 light functions: that of the mean, and one per component. */
interface CoefficientManifest extends Manifest {
  scalars?: number;
  clusters?: number;
  light_basis?: { kind: string; centers: Triple[]; spreads: number[] };
  light_coefficients?: { file: string };
  w_table?: { file: string; size: number; columns: number };
}

export function checkCoefficientMaps(manifest: CoefficientManifest, layers: number, fail: Fail): void {
  const { scalars, clusters = 1, light_basis, light_coefficients, w_table } = manifest;
  if (!(Number.isInteger(scalars) && Math.ceil((scalars as number) / 4) === layers)) fail("scalars four to an image", scalars);
  const functions = clusters * ((scalars as number) + 1);
  if (light_basis?.spreads.length !== functions) fail(`a spread for each of ${functions} light functions`, light_basis?.spreads.length);
  if (!light_coefficients) fail("light_coefficients", undefined);
  if (!w_table) fail("a w_table", undefined);
}

/** `clusterAt`: a node of the number of the cluster at `uv`; 0 everywhere unless given. */
export async function readCoefficientMaps(
  files: AssetFiles,
  manifest: CoefficientManifest,
  clusterAt: (kit: NodeKit, uv: N) => N = (kit) => kit.tsl.int(0),
): Promise<Tables> {
  const components = manifest.scalars as number;
  const clusters = manifest.clusters ?? 1;
  const count = clusters * (components + 1);
  const { centers, spreads } = manifest.light_basis as { centers: Triple[]; spreads: number[] };
  const { file: coefficientsFile } = manifest.light_coefficients as { file: string };
  const { file: tableFile, size } = manifest.w_table as { file: string; size: number };
  const [coefficients, table] = await Promise.all([
    files.bytes(coefficientsFile).then((buffer) => decodeFloat(buffer, coefficientsFile)),
    files.bytes(tableFile).then((buffer) => decodeHalf(buffer, tableFile)),
  ]);
  if (coefficients.width !== centers.length || coefficients.height !== count) {
    throw new SrbfError(`expected ${centers.length} x ${count} numbers in ${coefficientsFile}, found ${coefficients.width} x ${coefficients.height}`);
  }
  const rgb = new Float32Array(3 * count * centers.length);
  for (let i = 0; i < count * centers.length; ++i) rgb.set(coefficients.data.subarray(4 * i, 4 * i + 3), 3 * i);
  const functions = new LightFunctions(centers, spreads, rgb, manifest.domain);
  return {
    centers,
    maps: components,
    defines: { SRBF_COMPONENTS: components, SRBF_LAYERS: Math.ceil(components / 4) },
    vectors: {},
    integers: { srbfTableSize: size },
    textures: { srbfTable: table },
    weights: { kind: "texture", width: components + 1, height: clusters },
    projectedWeights: (lights) => functions.projected(lights),
    sum: (kit, uv, receiver) => sum(kit, { components, size, columns: table.width / size }, clusterAt, uv, receiver),
  };
}

function sum(
  kit: NodeKit,
  shape: { components: number; size: number; columns: number },
  clusterAt: (kit: NodeKit, uv: N) => N,
  uv: N,
  receiver: N,
): N {
  const { ivec2, textureLoad, vec3 } = kit.tsl;
  const { octahedralEncode, octahedralLookup } = kit.pack;
  const { components } = shape;
  const lookup = octahedralLookup(kit.texture("srbfTable"), shape.size, shape.columns);
  const weights = kit.texture("srbfWeights");
  const total = vec3(0).toVar();
  const cluster = clusterAt(kit, uv).toVar();
  total.addAssign(combined(kit, uv, components, (j) => textureLoad(weights, ivec2(j, cluster)).rgb, "k"));
  kit.addPointLights(total, receiver, (direction) => {
    const place = octahedralEncode(direction).toVar();
    const first = cluster.mul(components + 1).toVar();
    return combined(kit, uv, components, (j) => lookup(first.add(j), place), "m");
  });
  return total;
}
