/** An asset in memory: what `srbf fit` and `srbf export` write, decoded for upload to a GPU. */
import { decodeDds } from "./dds";
import { SrbfError } from "./errors";
import { decodeFloat, decodeHalf } from "./exr";
import { AssetFiles, type Fetch, fetched } from "./files";
import { checkSize, type FloatImage, padToFour } from "./image";
import { decodeKtx2 } from "./ktx2";
import { checkStack, extended, type LayerStack } from "./layers";
import { checkManifest, isPicture, type LayerEntry, layersOf, type Manifest, methodOf } from "./manifest";
import { IDENTITY, type Matrix4 } from "./matrix";
import type { Method, ReadOptions, Tables } from "./methods/method";
import { decodePng } from "./png";
import { type Probes, readProbes } from "./probes";

export interface Asset {
  readonly manifest: Manifest;
  /** The asset's method; `tables` is what it has read. */
  readonly method: Method;
  readonly tables: Tables;
  readonly layers: LayerStack;
  /** (N, 4) each: value = stored * scale + bias; channels past a map's three are 0. */
  readonly scale: Float32Array;
  readonly bias: Float32Array;
  /** World position of every receiver, meters, (H, W, 4). */
  readonly position?: FloatImage;
  readonly ambient?: FloatImage;
  /** Coverage of a view that does not fill its picture, 0 to 1, (H, W). Layers hold straight colors, not multiplied by it. */
  readonly alpha?: FloatImage;
  /** Where they are, of an asset whose receivers are probes. */
  readonly probes?: Probes;
  readonly assetFromWorld: Matrix4;
}

export interface LoadOptions extends ReadOptions {
  /** In place of the browser's own. */
  fetch?: Fetch;
  /** Compare every file with the checksum that asset.json records; needs a secure context (https or localhost). */
  verify?: boolean;
}

/**
 * Fetch and decode the asset at `url`, a folder that holds asset.json.
 *
 * @throws SrbfError in one line where a file is missing, damaged, or differs from asset.json.
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
  const method = methodOf(manifest);
  const files = new AssetFiles(folder, fetcher, manifest, options.verify ?? false);
  const entries = layersOf(manifest);
  const [layers, tables, position, ambient, alpha, probes] = await Promise.all([
    readLayers(files, manifest, entries),
    method.read(files, manifest, options),
    readImage(files, manifest, manifest.position),
    readImage(files, manifest, manifest.ambient),
    readAlpha(files, manifest),
    readProbes(files, manifest),
  ]);
  const further = tables.furtherLayers ?? [];
  return {
    manifest,
    method,
    tables,
    layers: extended(layers, further, place),
    scale: fours(entries, "scale", further.length, 1),
    bias: fours(entries, "bias", further.length, 0),
    position,
    ambient,
    alpha,
    probes,
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
      if (encoding === "half") return checkSize(decodeHalf(buffer, entry.file), manifest, entry.file).data;
      if (encoding === "float") return checkSize(decodeFloat(buffer, entry.file), manifest, entry.file).data;
      if (encoding !== "uint8") throw new SrbfError(`expected ${encoding} layers in a .dds or .ktx2 file, found ${entry.file}`);
      const png = checkSize(decodePng(buffer, entry.file), manifest, entry.file);
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

async function readImage(files: AssetFiles, manifest: Manifest, name: string | undefined): Promise<FloatImage | undefined> {
  return name === undefined ? undefined : checkSize(decodeFloat(await files.bytes(name), name), manifest, name);
}

async function readAlpha(files: AssetFiles, manifest: Manifest): Promise<FloatImage | undefined> {
  const image = isPicture(manifest) ? await readImage(files, manifest, manifest.coverage) : undefined;
  if (!image) return undefined;
  const { width, height, channels } = image;
  const data = Float32Array.from({ length: width * height }, (_, i) => Math.min(1, Math.max(0, image.data[channels * i])));
  return data.every((share) => share === 1) ? undefined : { kind: "float", width, height, channels: 1, data };
}

/** `further`: layers that come after the entries', with this value. */
function fours(entries: LayerEntry[], key: "scale" | "bias", further: number, value: number): Float32Array {
  const out = new Float32Array(4 * (entries.length + further)).fill(value, 4 * entries.length);
  entries.forEach((entry, i) => out.set(entry[key], 4 * i));
  return out;
}
