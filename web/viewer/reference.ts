/** The capture's images, and which of its lights is nearest to a direction. */
import { DataTexture, FloatType, LinearFilter, NoColorSpace, RGBAFormat } from "three";
import type { FloatImage, Triple } from "../src";
import { decodeFloat } from "../src/exr";
import { fetched } from "../src/files";
import { dot } from "../src/matrix";
import type { DirectionPoint } from "./direction_widget";

const KEPT = 16;

export class References {
  private readonly images = new Map<number, Promise<FloatImage>>();
  private texture?: DataTexture;
  private shown = -1;

  private constructor(
    private readonly folder: string,
    readonly lights: readonly DirectionPoint[],
  ) {}

  /** @throws SrbfError where the list is missing. */
  static async load(folder: string): Promise<References> {
    const { lights } = await (await fetched(fetch.bind(window), `${folder}lights.json`)).json();
    return new References(folder, lights);
  }

  nearest(direction: Triple): number {
    const length = Math.hypot(...direction) || 1;
    let best = 0;
    this.lights.forEach((light, i) => {
      if (dot(light.direction, direction) / length > dot(this.lights[best].direction, direction) / length) best = i;
    });
    return best;
  }

  /** @throws SrbfError where it cannot be read. */
  image(index: number): Promise<FloatImage> {
    let image = this.images.get(index);
    if (!image) {
      const name = `${this.folder}${index}.exr`;
      image = fetched(fetch.bind(window), name)
        .then((response) => response.arrayBuffer())
        .then((buffer) => decodeFloat(buffer, name));
      image.catch(() => this.images.delete(index));
      this.images.set(index, image);
      for (const old of this.images.keys()) if (this.images.size > KEPT) this.images.delete(old);
    }
    return image;
  }

  /** `image` as a texture, row 0 first; the previous one is released. */
  asTexture(index: number, image: FloatImage): DataTexture {
    if (this.texture && this.shown === index) return this.texture;
    this.texture?.dispose();
    const texture = new DataTexture(image.data as never, image.width, image.height, RGBAFormat, FloatType);
    texture.colorSpace = NoColorSpace;
    texture.magFilter = texture.minFilter = LinearFilter;
    texture.needsUpdate = true;
    this.texture = texture;
    this.shown = index;
    return texture;
  }
}

/** Root of the mean squared difference over covered texels and channels. */
export function rmse(relit: Float32Array, reference: FloatImage, color: Triple, ambient: FloatImage | undefined, covered: (texel: number) => boolean): number {
  let sum = 0;
  let count = 0;
  for (let i = 0; i < reference.width * reference.height; ++i) {
    if (!covered(i)) continue;
    for (let c = 0; c < 3; ++c) {
      const shine = ambient ? ambient.data[ambient.channels * i + c] : 0;
      sum += (relit[4 * i + c] - shine - Math.max(0, reference.data[reference.channels * i + c] * color[c])) ** 2;
      ++count;
    }
  }
  return Math.sqrt(sum / Math.max(1, count));
}
