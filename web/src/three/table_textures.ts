/** An asset's tables as textures of the passes that multiply by them. */
import { DataTexture, DataUtils, HalfFloatType, RedFormat, RGBAFormat } from "three";
import type { LightValues } from "../light_values";

const WIDTH = 4096; // texels
export const PART = 64; // columns that one texel of a pass adds up

/** A table as half floats, row after row, and what they are multiplied by. Rounded to nearest: three.js' own conversion cuts digits off. */
export function tableTexture({ data, gray, functions, count }: LightValues): { texture: DataTexture; scale: number } {
  const texels = functions * count;
  const [width, height] = [Math.min(WIDTH, texels), Math.ceil(texels / WIDTH)];
  const halves = new Uint16Array((gray ? 1 : 4) * width * height);
  const largest = data.reduce((most, x) => Math.max(most, Math.abs(x)), 0);
  const scale = 2 ** Math.ceil(Math.log2(Math.max(largest, 1e-30))) / 4096;
  const digits = 2 ** 42 + 1; // leaves 11 of a double's 53
  const half = (x: number) => {
    const spread = (x / scale) * digits;
    return DataUtils.toHalfFloat(spread - (spread - x / scale));
  };
  const [step, channels] = gray ? [1, 1] : [4, 3];
  for (let i = 0; i < texels; ++i) for (let c = 0; c < channels; ++c) halves[step * i + c] = half(data[channels * i + c]);
  const texture = new DataTexture(halves, width, height, gray ? RedFormat : RGBAFormat, HalfFloatType);
  texture.needsUpdate = true;
  return { texture, scale };
}

/** Write RGB numbers into a texture that is added to a table's sums. */
export function addedNumbers(texture: DataTexture, numbers: Float64Array): void {
  const data = texture.image.data as Float32Array;
  for (let i = 0; i < numbers.length; ++i) data[4 * Math.floor(i / 3) + (i % 3)] = numbers[i];
  texture.needsUpdate = true;
}
