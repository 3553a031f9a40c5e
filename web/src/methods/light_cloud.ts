/** The light cloud: indirect light of lights inside the scene, from the responses to patches of its surfaces [Kristensen2005]. */
import { type EnvironmentManifest, EnvironmentTable } from "../environment_table";
import { SrbfError } from "../errors";
import { decodeFloat } from "../exr";
import type { AssetFiles } from "../files";
import { type LightValues, readLightValues, readTable, summed, type TableEntry } from "../light_values";
import type { Triple } from "../matrix";
import { Occluders } from "../occluders";
import { checkPositionTable, type PositionManifest, PositionTable } from "../position_table";
import { Cells, FAR } from "../received_light";
import { shapeWeights } from "../shape_weights";
import { reflectanceOf, Surfaces, type SurfacesManifest, type SurfelReflection } from "../surface_changes";
import { type Placed, placed, type Surfels } from "../surfels";
import { readOccluders } from "../triangles";
import { checkWeightedComponents, type ComponentsManifest, functionsOf, readWeightedComponents, WEIGHTED_COMPONENTS } from "../weighted_components";
import type { Fail, Method, ReadOptions, Tables } from "./method";

/** Keys of asset.json that this method adds. */
interface LightCloudManifest extends ComponentsManifest, PositionManifest, SurfacesManifest, EnvironmentManifest {
  cells?: { file: string };
  interpolation?: { kind: string };
  free_places?: Triple[];
  /** Of direct-to-indirect transfer: numbers of shapes and surfels; with a file, weights of shapes from the irradiance on the surfels. */
  surfel_transfer?: Partial<TableEntry> & { rank: number; surfels: number };
  /** Without: the same from what surfels reflect, of light that was reflected once, and what later reflections add to them. */
  surfel_gather?: TableEntry;
  surfel_albedo?: TableEntry;
  surfel_series?: TableEntry;
}


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
      const isotropic = (light.kind === "point" || light.kind === "sphere") && !light.profile;
      const asBaked = surfaces?.change === undefined; // the table knows no other surfaces
      if (table && asBaked && isotropic && light.falloff === "inverse-square" && !(exact && rays)) return table.at(light.position).weights.map((weight) => weight * light.a0 ** 2);
      if (rays) return rays.weights(light);
      throw new SrbfError(`expected an asset of patches with cells.exr and scene.glb for a ${light.kind} light${"profile" in light ? " with a profile" : ""}, found none: its table of positions holds inverse-square point lights`);
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
    const [cells, corners, values, transfer] = await Promise.all([
      files.bytes(file).then((buffer) => new Cells(decodeFloat(buffer, file), file)),
      files.bytes(scene).then((buffer) => readOccluders(buffer, scene).corners),
      readLightValues(files, manifest, functions),
      readTransfer(files, manifest),
    ]);
    const patches = (transfer.tables[0] ?? values).count;
    if (cells.patches > patches) throw new SrbfError(`expected cells of ${patches} patches in ${file}, found ${cells.patches}`);
    const { tables, reflection } = transfer;
    const surfaces = tables.length ? await Surfaces.read(files, manifest, reflection && tables[0], reflection) : undefined;
    return new Rays({ cells, corners, reflectance: reflection && reflectanceOf(reflection), tables: [...tables, values] }, surfaces);
  }

  /** Of a white light, (F, 3). */
  weights(light: Placed): Float64Array {
    const { occluders, surfaces } = this;
    const { cells, reflectance, tables } = this.surfels;
    const received = cells.under(light, occluders, FAR, tables[0].count);
    if (surfaces?.change) return summed(valuesOf(this.surfels), surfaces.received(received));
    const reflected = reflectance ? received.map((e, i) => e * reflectance[i]) : received;
    return tables.reduce((weights, table) => summed(table, weights), reflected);
  }
}

/** The tables from the irradiance on surfels, or from what they reflect, to weights of shapes: none, one of them, or two. @throws SrbfError on damaged files. */
async function readTransfer(files: AssetFiles, manifest: LightCloudManifest): Promise<{ tables: LightValues[]; reflection?: SurfelReflection }> {
  const { surfel_transfer: told, surfel_gather, surfel_albedo, surfel_series } = manifest;
  if (!told) return { tables: [] };
  const { rank, surfels } = told;
  if (!surfel_gather || !surfel_albedo || !surfel_series) {
    if (told.file === undefined) throw new SrbfError("expected a file of surfel_transfer, or surfel_gather, surfel_albedo and surfel_series in asset.json, found neither; fit the asset again");
    return { tables: [await readTable(files, told as TableEntry, rank, surfels)] };
  }
  const [gather, later, image] = await Promise.all([readTable(files, surfel_gather, rank, surfels), readTable(files, surfel_series, rank, rank), files.bytes(surfel_albedo.file)]);
  const { data, width, channels } = decodeFloat(image, surfel_albedo.file);
  if (width !== surfels || channels !== 4) throw new SrbfError(`expected ${surfels} RGBA numbers in ${surfel_albedo.file}, found ${width} x ${channels}`);
  for (let i = 0; i < rank; ++i) for (let c = 0; c < 3; ++c) later.data[3 * (rank + 1) * i + c] += 1;
  const albedo = Float64Array.from({ length: 3 * surfels }, (_, i) => data[4 * Math.floor(i / 3) + (i % 3)]);
  const units = Float64Array.from({ length: surfels }, (_, i) => (surfel_albedo.scale ?? 1) * data[4 * i + 3]);
  return { tables: [gather, later], reflection: { albedo, units } };
}
