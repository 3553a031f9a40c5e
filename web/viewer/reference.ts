/** The capture's images, and which of its lights is nearest to a direction. */
import { DataTexture, FloatType, LinearFilter, NoColorSpace, RGBAFormat } from "three";
import type { FloatImage, Triple } from "../src";
import { decodeFloat } from "../src/exr";
import { fetched } from "../src/files";
import { dot } from "../src/matrix";

const KEPT = 16;

/** A captured light that can be placed: at infinity, or inside the scene (m, of unit irradiance at 1 m, inverse-square). */
export interface BakedLight {
  direction?: Triple;
  position?: Triple;
  role: "train" | "validation" | "holdout";
  /** Number of its image. */
  image: number;
}

export class References {
  private readonly images = new Map<number, Promise<FloatImage>>();
  private texture?: DataTexture;
  private shown = -1;

  private constructor(
    private readonly folder: string,
    readonly lights: readonly BakedLight[],
  ) {}

  /** @throws SrbfError where the list is missing. */
  static async load(folder: string): Promise<References> {
    const { lights } = await (await fetched(fetch.bind(window), `${folder}lights.json`)).json();
    return new References(folder, lights);
  }

  /** Index of the light that is nearest to a direction or a position. */
  nearest({ direction, position }: { direction?: Triple; position?: Triple }): number {
    const away = (light: BakedLight): number => {
      if (position && light.position) return Math.hypot(...light.position.map((x, k) => x - position[k]));
      return direction && light.direction ? -dot(light.direction, direction) : Infinity;
    };
    return this.lights.reduce((best, light, i) => (away(light) < away(this.lights[best]) ? i : best), 0);
  }

  /** @throws SrbfError where it cannot be read. */
  image(index: number): Promise<FloatImage> {
    let image = this.images.get(index);
    if (!image) {
      const name = `${this.folder}${this.lights[index].image}.exr`;
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
