/** Light linking of direct light: the pixels of a view that a light shines on, and what shadows it. */
import { DataTexture, type Mesh, type Object3D, RedFormat, UnsignedByteType } from "three";
import type { FloatImage, Links, Objects, Triple } from "../src";
import { isChosen } from "../src/light_linking";
import { Occluders } from "../src/occluders";
import { geometryOf, objectName } from "./shadow_casters";

const KEPT = 16; // choices

/** What a light chooses, all without: the red of `lit` is 0 at texels that it does not shine on; `casts`: whether an object shadows it, by its name. */
export interface LightChoice {
  readonly lit?: DataTexture;
  readonly casts?: (name: string) => boolean;
}

export class LinkedPixels {
  private readonly textures = new Map<string, DataTexture>();
  /** Names of objects, and the number of that which each pixel shows; found when a light first asks. */
  private found?: { names: string[]; objects: Int32Array };

  /** `position`, `coverage`: of the pixels, in the asset's frame as `scene` is after its turn; `center`: a place among them. */
  constructor(
    private readonly scene: Object3D,
    private readonly position: FloatImage,
    private readonly coverage: FloatImage | undefined,
    private readonly center: Triple,
  ) {}

  choice({ receivers, blockers }: Links): LightChoice {
    return { lit: receivers && this.lit(receivers), casts: blockers && ((name) => isChosen(blockers, name)) };
  }

  private lit(receivers: Objects): DataTexture {
    const key = JSON.stringify(receivers);
    let texture = this.textures.get(key);
    if (!texture) {
      const { names, objects } = (this.found ??= this.shown());
      const own = names.map((name) => 255 * Number(isChosen(receivers, name)));
      texture = new DataTexture(Uint8Array.from(objects, (object) => own[object] ?? 0), this.position.width, this.position.height, RedFormat, UnsignedByteType);
      texture.needsUpdate = true;
      const [oldest] = this.textures;
      if (this.textures.size >= KEPT) {
        oldest[1].dispose();
        this.textures.delete(oldest[0]);
      }
      this.textures.set(key, texture);
    }
    return texture;
  }

  /** The object of the triangle that is nearest to each pixel's place. */
  private shown(): { names: string[]; objects: Int32Array } {
    const { position, coverage, center } = this;
    const numbers = new Map<string, number>();
    const [corners, owners]: number[][] = [[], []];
    this.scene.updateMatrixWorld(true);
    this.scene.traverse((object) => {
      if (!(object as Mesh).isMesh) return;
      const geometry = geometryOf(object as Mesh, center);
      const [points, index] = [geometry.getAttribute("corner"), geometry.getIndex()];
      const name = objectName(object);
      const own = numbers.get(name) ?? numbers.size;
      numbers.set(name, own);
      for (let at = 0; at < (index ?? points).count; ++at) {
        const i = index ? index.getX(at) : at;
        corners.push(points.getX(i), points.getY(i), points.getZ(i));
        if (at % 3 === 2) owners.push(own);
      }
    });
    const triangles = new Occluders(new Float32Array(corners));
    const objects = new Int32Array(position.width * position.height).fill(-1);
    for (let i = 0; i < objects.length; ++i) {
      if (coverage && coverage.data[coverage.channels * i] <= 0) continue;
      const at = position.channels * i;
      const number = triangles.nearest(position.data[at] - center[0], position.data[at + 1] - center[1], position.data[at + 2] - center[2]);
      if (number >= 0) objects[i] = owners[number];
    }
    return { names: [...numbers.keys()], objects };
  }
}
