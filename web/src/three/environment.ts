/** A three.js environment map as a light of the library. */
import { DataUtils, HalfFloatType, type Texture } from "three";
import { SrbfError } from "../errors";
import { type EnvironmentLight, environmentLight } from "../lights";

/**
 * An equirectangular map of floats or half floats, as three's HDR and EXR loaders give it; its middle column looks along three's +x.
 *
 * @throws SrbfError on other textures.
 */
export function environmentOf(texture: Texture, intensity = 1): EnvironmentLight {
  const { data, width, height } = texture.image as { data?: ArrayLike<number>; width: number; height: number };
  const halves = texture.type === HalfFloatType;
  const channels = data ? data.length / (width * height) : 0;
  if (!data || channels < 3 || !(halves ? data instanceof Uint16Array : data instanceof Float32Array)) {
    throw new SrbfError("expected an equirectangular texture of floats or half floats as environment, found another; load a .hdr or .exr map");
  }
  const pixels = new Float32Array(3 * width * height);
  for (let row = 0; row < height; ++row) {
    const from = texture.flipY ? row : height - 1 - row; // ours starts at the top
    for (let column = 0; column < width; ++column) {
      for (let c = 0; c < 3; ++c) {
        const value = data[channels * (from * width + column) + c];
        pixels[3 * (row * width + column) + c] = halves ? DataUtils.fromHalfFloat(value) : value;
      }
    }
  }
  return environmentLight(width, height, pixels, [intensity, intensity, intensity]);
}
