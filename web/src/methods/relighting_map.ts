/** Relighting maps: RGB coefficient maps of spherical Gaussians that share one spread [Wong2005]. */
import { GaussianSums } from "../environment_sums";
import { SrbfError } from "../errors";
import { decodeFloat } from "../exr";
import type { AssetFiles } from "../files";
import { lookup } from "../gaussian";
import { unit } from "../lights";
import type { Manifest } from "../manifest";
import type { Triple } from "../matrix";
import shader from "../shaders/relighting_map.glsl";
import type { N } from "../three/tsl/nodes";
import type { Fail, Method, Tables } from "./method";
import type { NodeKit } from "./node_kit";

/** Keys of asset.json that this method adds. */
interface RelightingMapManifest extends Manifest {
  basis?: { kind: string; centers?: Triple[]; spread?: number };
  r_table?: { file: string; size: number };
}

export const relightingMap: Method = {
  name: "relighting-map",
  layersKey: "maps",
  layerChannels: 3,
  mapsPerLayer: 1,
  mapsName: "maps",
  filterable: () => true,
  shader,

  check(manifest: RelightingMapManifest, layers: number, fail: Fail): void {
    const { basis, r_table } = manifest;
    if (basis?.kind !== "gaussian") fail("maps of Gaussians", basis?.kind);
    if (basis?.centers?.length !== layers) fail("as many centers as maps", basis?.centers?.length);
    if (!r_table) fail("an r_table", undefined);
  },

  async read(files: AssetFiles, manifest: RelightingMapManifest): Promise<Tables> {
    const { file, size } = manifest.r_table as { file: string; size: number };
    const table = decodeFloat(await files.bytes(file), file);
    if (table.width !== size || table.height !== 1 || table.channels !== 1) {
      throw new SrbfError(`expected a table of ${size} x 1 numbers in ${file}, found ${table.width} x ${table.height} x ${table.channels}`);
    }
    const centers = (manifest.basis?.centers as Triple[]).map(unit);
    const k = centers.length;
    const sums = new GaussianSums(centers, manifest.basis?.spread as number, manifest.domain, (cosine) => lookup(table.data, cosine));
    return {
      centers,
      maps: k,
      defines: { SRBF_K: k },
      vectors: { srbfCenters: new Float32Array(centers.flatMap((center) => [...center, 0])) },
      integers: {},
      textures: { srbfTable: table },
      weights: { kind: "uniform", width: k, height: 1 },
      projectedWeights({ distant, environments, assetFromWorld }) {
        const projected = new Float64Array(3 * k);
        sums.addDistant(distant, projected);
        for (const light of environments) sums.addEnvironment(light, assetFromWorld, projected);
        return projected;
      },
      sum: (kit, uv, receiver) => sum(kit, table.width, uv, receiver),
    };
  },
};

function sum(kit: NodeKit, tableSize: number, uv: N, receiver: N): N {
  const { versine, weight } = kit.pack;
  const { vec3 } = kit.tsl;
  const total = vec3(0).toVar();
  const [weights, centers, table] = [kit.vectors("srbfWeights"), kit.vectors("srbfCenters"), kit.texture("srbfTable")];
  kit.each(kit.layers, "k", (k) => total.addAssign(kit.decoded(uv, k).rgb.mul(weights.element(k).rgb)));
  kit.addPointLights(total, receiver, (direction) => {
    const response = vec3(0).toVar();
    kit.each(kit.layers, "m", (m) => {
      const cosine = versine(direction, centers.element(m).xyz).oneMinus();
      response.addAssign(kit.decoded(uv, m).rgb.mul(weight(table, tableSize, cosine)));
    });
    return response;
  });
  return total;
}
