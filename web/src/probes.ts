/** Probes of an asset: a grid of points in free space whose light falls on what moves: `srbf/probe_grid.py`. */
import { SrbfError } from "./errors";
import { decodeFloat, decodeHalf } from "./exr";
import type { AssetFiles } from "./files";
import { checkSize, type FloatImage, type HalfImage } from "./image";
import type { Manifest, Receiver } from "./manifest";
import type { Triple } from "./matrix";

export const FACETS = 12;
export const HARMONICS = 9;
/** Texels of a node's harmonics: 27 numbers by four. */
export const LIGHT_TEXELS = 7;
/** Nodes on a side of a probe's octahedral tile. */
export const PROBE_TILE = 17;

/** Keys of a receiver of kind `probes`. */
interface ProbesReceiver extends Receiver {
  origin: Triple;
  /** Meters. */
  spacing: number;
  counts: Triple;
  places: string;
  nearness: string;
}

export interface Probes {
  /** Meters, the asset's frame. */
  readonly origin: Triple;
  readonly spacing: number;
  readonly counts: Triple;
  /** (YZ, X): x, y, z of every node's probe, m, and the number of the node whose light it has. */
  readonly places: FloatImage;
  /** Octahedral tiles of 1 / distance to the surfaces around each probe, 1/m. */
  readonly nearness: HalfImage;
}

/** Undefined for other receivers. @throws SrbfError on files that do not fit the manifest. */
export async function readProbes(files: AssetFiles, manifest: Manifest): Promise<Probes | undefined> {
  const told = manifest.receiver as ProbesReceiver | undefined;
  if (told?.kind !== "probes") return undefined;
  const { origin, spacing, counts, places: placesFile, nearness: nearnessFile } = told;
  const whole = Array.isArray(counts) && counts.length === 3 && counts.every((count) => Number.isInteger(count) && count >= 1);
  if (!whole || !(spacing > 0) || !Array.isArray(origin) || origin.length !== 3 || typeof placesFile !== "string" || typeof nearnessFile !== "string") {
    throw new SrbfError("expected origin, spacing, counts, places and nearness of probes in asset.json, found others; fit the asset again");
  }
  const [x, y, z] = counts;
  checkSize(manifest, { width: FACETS * x, height: y * z }, "asset.json");
  const [places, nearness] = await Promise.all([
    files.bytes(placesFile).then((buffer) => checkSize(decodeFloat(buffer, placesFile), { width: x, height: y * z }, placesFile)),
    files.bytes(nearnessFile).then((buffer) => decodeHalf(buffer, nearnessFile)),
  ]);
  const count = x * y * z;
  for (let i = 0; i < count; ++i) {
    const source = Math.round(places.data[4 * i + 3]);
    if (!(source >= 0 && source < count)) throw new SrbfError(`expected sources of 0 to ${count - 1} in ${placesFile}, found ${source}; fit the asset again`);
  }
  const { width, height, channels } = nearness;
  if (channels !== 1 || width % PROBE_TILE || height % PROBE_TILE || (width / PROBE_TILE) * (height / PROBE_TILE) < count) {
    throw new SrbfError(`expected ${count} tiles of ${PROBE_TILE}x${PROBE_TILE} in ${nearnessFile}, found ${width}x${height} texels; fit the asset again`);
  }
  return { origin, spacing, counts, places, nearness };
}

/** @throws SrbfError on an asset of other receivers. */
export function probesOf({ probes, manifest }: { probes?: Probes; manifest: Manifest }): Probes {
  if (probes) return probes;
  throw new SrbfError(`expected an asset of probes, found one of a ${manifest.receiver?.kind ?? "picture"}; srbf bake --receiver probes`);
}

/** Unit normals of the facets, the vertices of an icosahedron: `facet_normals` of `srbf/basis/irradiance_harmonics.py`. */
export function facetNormals(): Triple[] {
  const golden = (1 + Math.sqrt(5)) / 2;
  const length = Math.hypot(1, golden);
  const even = [-1, 1].flatMap((a) => [-1, 1].map((b): Triple => [0, a / length, (b * golden) / length]));
  return [0, 1, 2].flatMap((turn) => even.map((v): Triple => [v[(3 - turn) % 3], v[(4 - turn) % 3], v[(5 - turn) % 3]]));
}

/** The nine harmonics l <= 2 at a unit direction, degree by degree, as three.js has them. */
export function harmonicsAt([x, y, z]: Triple): number[] {
  const [zero, one, two] = [0.5 / Math.sqrt(Math.PI), Math.sqrt(3 / (4 * Math.PI)), Math.sqrt(15 / (4 * Math.PI))];
  return [zero, one * y, one * z, one * x, two * x * y, two * y * z, Math.sqrt(5 / (16 * Math.PI)) * (3 * z * z - 1), two * x * z, (two / 2) * (x * x - y * y)];
}

/** From irradiance on the facets to harmonics of radiance, [facet][harmonic] [Ramamoorthi2001, eq. 8]: `radiance_harmonics`. */
export function harmonicWeights(): number[][] {
  const lobe = [1, 2 / 3, 2 / 3, 2 / 3, 1 / 4, 1 / 4, 1 / 4, 1 / 4, 1 / 4];
  return facetNormals().map((normal) => harmonicsAt(normal).map((value, k) => ((4 / FACETS) * value) / lobe[k]));
}
