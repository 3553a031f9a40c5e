/** An asset in memory: what `srbf fit` and `srbf export` write, decoded as far as a GPU wants it. */
import { decodeDds } from "./dds";
import { SrbfError } from "./errors";
import { decodeFloat, decodeHalf } from "./exr";
import { AssetFiles, type Fetch, fetched } from "./files";
import { type ByteImage, type FloatImage, type HalfImage, padToFour } from "./image";
import { decodeKtx2 } from "./ktx2";
import { checkStack, type LayerStack } from "./layers";
import type { LightFunctions } from "./light_functions";
import { unit } from "./lights";
import { checkManifest, isPicture, type LayerEntry, layersOf, type Manifest } from "./manifest";
import { IDENTITY, type Matrix4, type Triple } from "./matrix";
import { decodePng } from "./png";

/** What the layers weigh: Gaussians with their 1D table, or RGB light functions with their octahedral table. */
export type Basis =
  | { readonly kind: "gaussian"; readonly centers: readonly Triple[]; readonly table: Float32Array }
  | {
      readonly kind: "light-functions";
      readonly functions: LightFunctions;
      readonly scalars: number;
      readonly clusters: number;
      readonly wTable: HalfImage;
      readonly tableSize: number;
      /** The cluster of every texel, (H, W). */
      readonly clusterIndex?: ByteImage;
    };

export interface Asset {
  readonly manifest: Manifest;
  readonly layers: LayerStack;
  /** (N, 4) each: value = stored * scale + bias; channels past a map's three are 0. */
  readonly scale: Float32Array;
  readonly bias: Float32Array;
  readonly basis: Basis;
  /** World position of every receiver, meters, (H, W, 4). */
  readonly position?: FloatImage;
  readonly ambient?: FloatImage;
  /** Of a view that does not fill its picture: the share of every texel that is there, (H, W). Layers hold colors that are not multiplied by it. */
  readonly alpha?: FloatImage;
  readonly assetFromWorld: Matrix4;
}

export interface LoadOptions {
  /** In place of the browser's own. */
  fetch?: Fetch;
  /** Compare every file with the checksum that asset.json records; needs a secure context (https or localhost). */
  verify?: boolean;
}

/**
 * Fetch and decode the asset at `url`, a folder that holds asset.json.
 *
 * @throws SrbfError in one line where a file is missing, damaged, or not what asset.json says.
 */
export async function loadAsset(url: string, options: LoadOptions = {}): Promise<Asset> {
  const fetcher = options.fetch ?? ((target: string) => fetch(target));
  const folder = url.replace(/asset\.json$/, "").replace(/\/*$/, "/");
  const place = `${folder}asset.json`;
  let json: unknown;
  try {
    json = await (await fetched(fetcher, place)).json();
  } catch (error) {
    if (error instanceof SrbfError) throw error;
    throw new SrbfError(`expected JSON at ${place}, found something else; srbf fit and srbf export write it`);
  }
  const manifest = checkManifest(json, place);
  const files = new AssetFiles(folder, fetcher, manifest, options.verify ?? false);
  const entries = layersOf(manifest);
  const [layers, basis, position, ambient, alpha] = await Promise.all([
    readLayers(files, manifest, entries),
    readBasis(files, manifest),
    readImage(files, manifest, manifest.position),
    readImage(files, manifest, manifest.ambient),
    readAlpha(files, manifest),
  ]);
  return {
    manifest,
    layers,
    scale: fours(entries, "scale"),
    bias: fours(entries, "bias"),
    basis,
    position,
    ambient,
    alpha,
    assetFromWorld: manifest.asset_from_world ?? IDENTITY,
  };
}

async function readLayers(files: AssetFiles, manifest: Manifest, entries: LayerEntry[]): Promise<LayerStack> {
  const { width, height } = manifest;
  const { encoding, file } = entries[0];
  const expected = { width, height, count: entries.length, encoding };
  if (/\.(dds|ktx2)$/.test(file)) {
    if (entries.some((entry, i) => entry.file !== file || (entry.layer ?? i) !== i)) {
      throw new SrbfError(`expected all layers of ${file} in their order, found others; export the asset again`);
    }
    const buffer = await files.bytes(file);
    return checkStack(file.endsWith(".dds") ? decodeDds(buffer, file) : decodeKtx2(buffer, file), expected, file);
  }
  const images = await Promise.all(
    entries.map(async (entry) => {
      const buffer = await files.bytes(entry.file);
      if (encoding === "half") return sized(decodeHalf(buffer, entry.file), manifest, entry.file).data;
      if (encoding === "float") return sized(decodeFloat(buffer, entry.file), manifest, entry.file).data;
      if (encoding !== "uint8") throw new SrbfError(`expected ${encoding} layers in a .dds or .ktx2 file, found ${entry.file}`);
      const png = sized(decodePng(buffer, entry.file), manifest, entry.file);
      return padToFour(png.data, png.channels);
    }),
  );
  const size = width * height * 4;
  const all = encoding === "half" ? new Uint16Array(size * images.length) : encoding === "float" ? new Float32Array(size * images.length) : new Uint8Array(size * images.length);
  images.forEach((data, i) => {
    if (data.length !== size) throw new SrbfError(`expected three or four channels in ${entries[i].file}, found ${data.length / (width * height)}`);
    all.set(data, i * size);
  });
  return { ...expected, levels: [all] };
}

async function readBasis(files: AssetFiles, manifest: Manifest): Promise<Basis> {
  if (manifest.method === "relighting-map") {
    const { file, size } = manifest.r_table as { file: string; size: number };
    const table = decodeFloat(await files.bytes(file), file);
    if (table.width !== size || table.height !== 1 || table.channels !== 1) {
      throw new SrbfError(`expected a table of ${size} x 1 numbers in ${file}, found ${table.width} x ${table.height} x ${table.channels}`);
    }
    return { kind: "gaussian", centers: (manifest.basis?.centers as Triple[]).map(unit), table: table.data };
  }
  const scalars = manifest.scalars as number;
  const clusters = manifest.clusters ?? 1;
  const functions = clusters * (scalars + 1);
  const { centers, spreads } = manifest.light_basis as { centers: Triple[]; spreads: number[] };
  const { file: coefficientsFile } = manifest.light_coefficients as { file: string };
  const { file: tableFile, size: tableSize } = manifest.w_table as { file: string; size: number };
  const indexFile = manifest.cluster_index?.file;
  const [coefficients, wTable, clusterIndex] = await Promise.all([
    files.bytes(coefficientsFile).then((buffer) => decodeFloat(buffer, coefficientsFile)),
    files.bytes(tableFile).then((buffer) => decodeHalf(buffer, tableFile)),
    indexFile === undefined ? undefined : files.bytes(indexFile).then((buffer) => sized(decodePng(buffer, indexFile), manifest, indexFile)),
  ]);
  if (coefficients.width !== centers.length || coefficients.height !== functions) {
    throw new SrbfError(`expected ${centers.length} x ${functions} numbers in ${coefficientsFile}, found ${coefficients.width} x ${coefficients.height}`);
  }
  const rgb = new Float32Array(3 * functions * centers.length);
  for (let i = 0; i < functions * centers.length; ++i) rgb.set(coefficients.data.subarray(4 * i, 4 * i + 3), 3 * i);
  if (clusterIndex && clusterIndex.channels !== 1) throw new SrbfError(`expected one channel in ${indexFile}, found ${clusterIndex.channels}`);
  return { kind: "light-functions", functions: { centers, spreads, coefficients: rgb }, scalars, clusters, wTable, tableSize, clusterIndex };
}

async function readImage(files: AssetFiles, manifest: Manifest, name: string | undefined): Promise<FloatImage | undefined> {
  return name === undefined ? undefined : sized(decodeFloat(await files.bytes(name), name), manifest, name);
}

async function readAlpha(files: AssetFiles, manifest: Manifest): Promise<FloatImage | undefined> {
  const image = isPicture(manifest) ? await readImage(files, manifest, manifest.coverage) : undefined;
  if (!image) return undefined;
  const { width, height, channels } = image;
  const data = Float32Array.from({ length: width * height }, (_, i) => Math.min(1, Math.max(0, image.data[channels * i])));
  return data.every((share) => share === 1) ? undefined : { kind: "float", width, height, channels: 1, data };
}

function sized<I extends { width: number; height: number }>(image: I, manifest: Manifest, where: string): I {
  const { width, height } = manifest;
  if (image.width !== width || image.height !== height) {
    throw new SrbfError(`expected ${width}x${height} texels in ${where}, found ${image.width}x${image.height}`);
  }
  return image;
}

function fours(entries: LayerEntry[], key: "scale" | "bias"): Float32Array {
  const out = new Float32Array(4 * entries.length);
  entries.forEach((entry, i) => out.set(entry[key], 4 * i));
  return out;
}
