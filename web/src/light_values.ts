/** What captured lights add to the weights of an asset's functions, for lights that are no directions: named ones, patches, points of a cloud. */
import { SrbfError } from "./errors";
import { decodeFloat } from "./exr";
import type { AssetFiles } from "./files";
import type { FloatImage } from "./image";
import type { Manifest } from "./manifest";
import type { Fail } from "./methods/method";
import { type Packed, unpacked } from "./packed_table";
import { decodePng } from "./png";

/** Keys of asset.json of methods whose functions are known at the captured lights alone. */
export interface LightValuesManifest extends Manifest {
  /** Value = stored times `scale`, 1 unless given. */
  light_values?: { file: string; lights?: number; scale?: number };
}

/** Values of F functions at `count` lights: `data` is (F, count, 3), row by row, or (F, count) of gray ones. */
export interface LightValues {
  readonly functions: number;
  readonly count: number;
  readonly data: Float32Array;
  readonly gray: boolean;
}

export function checkLightValues({ light_values }: LightValuesManifest, fail: Fail): void {
  if (typeof light_values?.file !== "string" || !Number.isFinite(light_values.scale ?? 1)) fail("light_values", light_values);
}

/** `count` columns of lights, by default as many as the manifest says. @throws SrbfError on a file of another size, or a damaged one. */
export async function readLightValues(files: AssetFiles, manifest: LightValuesManifest, functions: number, count?: number): Promise<LightValues> {
  const entry = manifest.light_values as TableEntry & { lights?: number };
  return readTable(files, entry, functions, count ?? entry.lights);
}

/** A file of a table, and what its numbers are multiplied by. */
export interface TableEntry {
  file: string;
  scale?: number;
  packed?: Packed;
}

/** A table of `rows` and `columns` of gray or RGB numbers, by default as many columns as the file has. @throws SrbfError as `readLightValues`. */
export async function readTable(files: AssetFiles, entry: TableEntry, rows: number, columns?: number): Promise<LightValues> {
  const image = await tableImage(files, entry, rows, columns);
  const { file, scale = 1 } = entry;
  const count = columns ?? image.width;
  if (image.width !== count || image.height !== rows || (image.channels < 3 && image.channels !== 1)) {
    throw new SrbfError(`expected ${count} x ${rows} RGB numbers in ${file}, found ${image.width} x ${image.height} x ${image.channels}`);
  }
  const gray = image.channels === 1;
  const channels = gray ? 1 : 3;
  const data = new Float32Array(channels * count * rows);
  for (let i = 0; i < count * rows; ++i) for (let c = 0; c < channels; ++c) data[channels * i + c] = scale * image.data[image.channels * i + c];
  return { functions: rows, count, data, gray };
}

/** A table's file, packed or not, as numbers that are to be multiplied by its scale. @throws SrbfError on a damaged file. */
export async function tableImage(files: AssetFiles, { file, packed }: TableEntry, rows: number, columns?: number): Promise<FloatImage> {
  const buffer = await files.bytes(file);
  if (!packed) return decodeFloat(buffer, file);
  const picture = decodePng(buffer, file);
  return unpacked(picture, rows, columns ?? picture.width - 1, packed, file);
}

/** `count` gray numbers as RGB; those that are missing are 0. */
export function rgb(gray: Float64Array, count: number): Float64Array {
  return Float64Array.from({ length: 3 * count }, (_, i) => gray[Math.floor(i / 3)] ?? 0);
}

/** Sum over lights of color times values, (F, 3); `colors` (count, 3), or (n,) of gray ones, n <= count. */
export function summed({ functions, count, data, gray }: LightValues, colors: Float64Array): Float64Array {
  if (colors.length <= count) colors = rgb(colors, count);
  const out = new Float64Array(3 * functions);
  const [step, green, blue] = gray ? [1, 0, 0] : [3, 1, 2];
  for (let f = 0, at = 0; f < functions; ++f) {
    let [r, g, b] = [0, 0, 0];
    for (let light = 0; light < 3 * count; light += 3, at += step) {
      r += data[at] * colors[light];
      g += data[at + green] * colors[light + 1];
      b += data[at + blue] * colors[light + 2];
    }
    out.set([r, g, b], 3 * f);
  }
  return out;
}
