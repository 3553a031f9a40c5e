/** Decoded images: row 0 at the top, channels next to each other. */
import { SrbfError } from "./errors";

export interface HalfImage {
  kind: "half";
  width: number;
  height: number;
  channels: number;
  /** Bits of half floats. */
  data: Uint16Array;
}

export interface FloatImage {
  kind: "float";
  width: number;
  height: number;
  channels: number;
  data: Float32Array;
}

export interface ByteImage {
  kind: "uint8";
  width: number;
  height: number;
  channels: number;
  data: Uint8Array;
}

/** Reverse the order of the rows, in place. */
export function flipRows(data: Uint16Array | Float32Array, height: number): void {
  const stride = data.length / height;
  const kept = data.slice(0, stride);
  for (let top = 0, bottom = height - 1; top < bottom; ++top, --bottom) {
    kept.set(data.subarray(top * stride, (top + 1) * stride));
    data.copyWithin(top * stride, bottom * stride, (bottom + 1) * stride);
    data.set(kept, bottom * stride);
  }
}

/** Bytes of `channels` as four: what is missing is 255. */
export function padToFour(data: Uint8Array, channels: number): Uint8Array {
  if (channels === 4) return data;
  const out = new Uint8Array((data.length / channels) * 4).fill(255);
  for (let i = 0, j = 0; i < data.length; i += channels, j += 4) {
    for (let c = 0; c < channels; ++c) out[j + c] = data[i + c];
  }
  return out;
}

/** @throws SrbfError on an image of another size than `expected`. */
export function checkSize<I extends { width: number; height: number }>(image: I, expected: { width: number; height: number }, where: string): I {
  const { width, height } = expected;
  if (image.width !== width || image.height !== height) {
    throw new SrbfError(`expected ${width}x${height} texels in ${where}, found ${image.width}x${image.height}`);
  }
  return image;
}
