/** Where a coefficient map is stored, and how large its values are: what its false color is scaled to. */
import { DataUtils, type Vector4 } from "three";
import type { Asset } from "../src";
import type { ScreenUniforms } from "./screen";

const SAMPLES = 4096;
const QUANTILE = 0.98; // a few texels may be far larger than the rest

const known = new WeakMap<Asset, Map<number, number>>();

/** The layer of coefficient map `index`, and its channel there; without one the map is all three of RGB. */
function mapPlace(asset: Asset, index: number): { layer: number; channel?: number } {
  const { mapsPerLayer } = asset.method;
  return mapsPerLayer === 1 ? { layer: index } : { layer: Math.floor(index / mapsPerLayer), channel: index % mapsPerLayer };
}

/** Have the screen's uniforms show coefficient map `index`. */
export function showMap(uniforms: ScreenUniforms, asset: Asset, index: number): void {
  const { layer, channel } = mapPlace(asset, index);
  uniforms.layer.value = layer;
  uniforms.channel.value = channel ?? -1;
  (uniforms.layerScale.value as Vector4).fromArray(asset.scale, 4 * layer);
  (uniforms.layerBias.value as Vector4).fromArray(asset.bias, 4 * layer);
}

/** The 98 % quantile of the magnitude of coefficient map `index`; of a compressed one the largest that it can hold. */
export function mapRange(asset: Asset, index: number): number {
  const ranges = known.get(asset) ?? new Map<number, number>();
  known.set(asset, ranges);
  const range = ranges.get(index) ?? (measured(asset, index) || 1);
  ranges.set(index, range);
  return range;
}

function measured(asset: Asset, index: number): number {
  const { layer, channel } = mapPlace(asset, index);
  const channels = channel === undefined ? [0, 1, 2] : [channel];
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
