/** The light cloud: indirect light of lights inside the scene, from the responses to patches of its surfaces [Kristensen2005]. */
import { type EnvironmentManifest, EnvironmentTable } from "../environment_table";
import { SrbfError } from "../errors";
import { decodeFloat } from "../exr";
import type { AssetFiles } from "../files";
import { type LightValues, readLightValues, readRgbTable, rgb, summed, type TableEntry } from "../light_values";
import type { Triple } from "../matrix";
import { Occluders } from "../occluders";
import { checkPositionTable, type PositionManifest, PositionTable } from "../position_table";
import { Cells } from "../received_light";
import { shapeWeights } from "../shape_weights";
import { Surfaces, type SurfacesManifest } from "../surface_changes";
import { type Placed, placed, type Surfels } from "../surfels";
import { readOccluders } from "../triangles";
import { checkWeightedComponents, type ComponentsManifest, functionsOf, readWeightedComponents, WEIGHTED_COMPONENTS } from "../weighted_components";
import type { Fail, Method, ReadOptions, Tables } from "./method";

/** Keys of asset.json that this method adds. */
interface LightCloudManifest extends ComponentsManifest, PositionManifest, SurfacesManifest, EnvironmentManifest {
  cells?: { file: string };
  interpolation?: { kind: string };
  free_places?: Triple[];
  /** Of direct-to-indirect transfer: weights of the columns of `light_values` from the irradiance on the patches. */
  surfel_transfer?: TableEntry & { rank: number; surfels: number };
}

const FAR = 1e4; // meters: how far a distant light's shadow rays go

export const lightCloud: Method = {
  name: "light-cloud",
  ...WEIGHTED_COMPONENTS,

  check(manifest: LightCloudManifest, layers: number, fail: Fail): void {
    checkWeightedComponents(manifest, layers, fail);
    checkPositionTable(manifest, fail);
    if (!manifest.position_table && !hasRays(manifest)) fail("cells of patches and a scene, or a position_table", manifest.cells);
  },

  async read(files: AssetFiles, manifest: LightCloudManifest, { exact = false }: ReadOptions = {}): Promise<Tables> {
    const functions = functionsOf(manifest);
    const [parts, table, rays, environment] = await Promise.all([
      readWeightedComponents(files, manifest),
      manifest.position_table && PositionTable.read(files, manifest, functions),
      hasRays(manifest) ? Rays.read(files, manifest, functions) : undefined,
      EnvironmentTable.read(files, manifest),
    ]);
    const { surfels, surfaces } = rays ?? {};
    let version = 0; // of the surfaces
    let known = new Map<string, Float64Array>(); // weights of white lights: those that have not moved are not computed again
    const weightsOf = (light: Placed): Float64Array => {
      const isotropic = light.kind === "point" || light.kind === "sphere";
      const asBaked = surfaces?.change === undefined; // the table knows no other surfaces
      if (table && asBaked && isotropic && light.falloff === "inverse-square" && !(exact && rays)) return table.at(light.position).weights.map((weight) => weight * light.a0 ** 2);
      if (rays) return rays.weights(light);
      throw new SrbfError(`expected an asset of patches with cells.exr and scene.glb for a ${light.kind} light, found none: its table of positions holds inverse-square point lights`);
    };
    return {
      ...parts,
      places: manifest.free_places,
      projectsPunctual: true,
      surfels,
      surfaces,
      environment,
      projectedWeights(lights) {
        const out = new Float64Array(3 * functions);
        const used = new Map<string, Float64Array>();
        if (surfaces && surfaces.version !== version) {
          version = surfaces.version;
          known.clear();
        }
        for (const light of placed(lights)) {
          const key = JSON.stringify({ ...light, color: 1 });
          const weights = known.get(key) ?? used.get(key) ?? weightsOf(light);
          used.set(key, weights);
          for (let i = 0; i < out.length; ++i) out[i] += weights[i] * light.color[i % 3];
        }
        known = used;
        const added = shapeWeights({ surfaces, environment }, lights);
        if (added) summed(valuesOf(surfels), added).forEach((weight, i) => (out[i] += weight));
        return out;
      },
    };
  },
};

/** The table from the last weights before them to those of the light functions. */
const valuesOf = (surfels: Surfels | undefined): LightValues => surfels?.tables.at(-1) as LightValues;

function hasRays({ cells, scene, interpolation }: LightCloudManifest): boolean {
  return typeof cells?.file === "string" && typeof scene === "string" && interpolation?.kind !== "kernel"; // whose columns are captured lights, not patches
}

/** Weights by shadow rays to cells of the patches. */
class Rays {
  private readonly occluders: Occluders;

  private constructor(
    readonly surfels: Surfels,
    readonly surfaces: Surfaces | undefined,
  ) {
    this.occluders = new Occluders(surfels.corners);
  }

  static async read(files: AssetFiles, manifest: LightCloudManifest, functions: number): Promise<Rays> {
    const { file } = manifest.cells as { file: string };
    const scene = manifest.scene as string;
    const told = manifest.surfel_transfer;
    const [cells, corners, values, transfer] = await Promise.all([
      files.bytes(file).then((buffer) => new Cells(decodeFloat(buffer, file), file)),
      files.bytes(scene).then((buffer) => readOccluders(buffer, scene)),
      readLightValues(files, manifest, functions),
      told && readRgbTable(files, told, told.rank, told.surfels),
    ]);
    const patches = (transfer ?? values).count;
    if (cells.patches > patches) throw new SrbfError(`expected cells of ${patches} patches in ${file}, found ${cells.patches}`);
    const surfaces = transfer && (await Surfaces.read(files, manifest, transfer));
    return new Rays({ cells, corners, tables: transfer ? [transfer, values] : [values] }, surfaces);
  }

  /** Of a white light, (F, 3). */
  weights(light: Placed): Float64Array {
    const { occluders, surfaces } = this;
    const { cells, tables } = this.surfels;
    const received = light.kind === "area" ? cells.underArea(light, occluders) : light.kind === "directional" ? cells.underDistant(light.direction, occluders, FAR) : cells.underPoint(light, occluders);
    if (surfaces) return summed(valuesOf(this.surfels), surfaces.received(rgb(received, tables[0].count)));
    return tables.reduce((weights, table) => summed(table, weights), received);
  }
}
