/** How large a map's values are: what its false color is scaled to. */
import { DataUtils } from "three";
import type { Asset } from "../src";

const SAMPLES = 4096;
const QUANTILE = 0.98; // a few texels may be far larger than the rest

const known = new WeakMap<Asset, Map<number, number>>();

/** The 98 % quantile of the magnitude of map `index`, or of scalar plane `index`; of compressed ones the most that they can hold. */
export function mapRange(asset: Asset, index: number): number {
  const ranges = known.get(asset) ?? new Map<number, number>();
  known.set(asset, ranges);
  const range = ranges.get(index) ?? (measured(asset, index) || 1);
  ranges.set(index, range);
  return range;
}

function measured(asset: Asset, index: number): number {
  const planes = asset.manifest.scalars !== undefined;
  const layer = planes ? Math.floor(index / 4) : index;
  const channels = planes ? [index % 4] : [0, 1, 2];
  const { width, height, encoding, levels } = asset.layers;
  const [scale, bias] = [asset.scale, asset.bias].map((all) => all.subarray(4 * layer, 4 * layer + 4));
  if (encoding === "bc7" || encoding === "bc1") return Math.max(...channels.flatMap((c) => [Math.abs(bias[c]), Math.abs(scale[c] + bias[c])]));
  const decode = { half: DataUtils.fromHalfFloat, float: (x: number) => x, uint8: (x: number) => x / 255 }[encoding];
  const values: number[] = [];
  const texels = width * height;
  for (let i = 0; i < texels; i += Math.max(1, Math.floor(texels / SAMPLES))) {
    for (const c of channels) values.push(Math.abs(decode(levels[0][4 * (layer * texels + i) + c]) * scale[c] + bias[c]));
  }
  values.sort((a, b) => a - b);
  return values[Math.floor(QUANTILE * (values.length - 1))];
}
