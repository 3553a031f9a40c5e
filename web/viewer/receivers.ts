/** Positions of an asset's receivers: their bounds, and the position of a texel. */
import { type Asset, type FloatImage, IDENTITY, receiverKind, type Triple } from "../src";
import { carried, type Matrix4 } from "../src/matrix";

export interface Bounds {
  center: Triple;
  /** Of a sphere around the center. */
  radius: number;
}

export class Receivers {
  readonly bounds: Bounds;

  constructor(
    private readonly asset: Asset,
    private readonly coverage?: FloatImage,
  ) {
    this.bounds = this.measured();
  }

  /** Whether light is known at the vertices of a mesh alone, rather than between them. */
  get areVertices(): boolean {
    return receiverKind(this.asset.manifest) === "vertices";
  }

  covered(texel: number): boolean {
    return this.coverage === undefined || this.coverage.data[this.coverage.channels * texel] >= 0.5;
  }

  /** The world position of what the picture shows at u, v (v down); undefined where it shows nothing. */
  at(u: number, v: number): Triple | undefined {
    const { width, height } = this.asset.manifest;
    const [x, y] = [Math.floor(u * width), Math.floor(v * height)];
    if (!this.asset.position || x < 0 || y < 0 || x >= width || y >= height || !this.covered(y * width + x)) return undefined;
    return this.position(y * width + x);
  }

  private position(texel: number): Triple {
    const image = this.asset.position as FloatImage;
    const at = image.channels * texel;
    const p: Triple = [image.data[at], image.data[at + 1], image.data[at + 2]];
    return this.asset.assetFromWorld === IDENTITY ? p : carried(inverse(this.asset.assetFromWorld), p);
  }

  /** Bounds of the receivers; a view's without the outermost twentieth at either end of each axis, such as what it sees through a window. */
  private measured(): Bounds {
    const { width, height } = this.asset.manifest;
    const axes: number[][] = [[], [], []];
    const every = Math.max(1, Math.floor((width * height) / SAMPLES));
    for (let i = 0; this.asset.position && i < width * height; i += every) {
      if (this.covered(i)) this.position(i).forEach((x, c) => axes[c].push(x));
    }
    if (axes[0].length === 0) return { center: [0, 0, 0], radius: 1 };
    const ends = axes.map((values) => {
      values.sort((a, b) => a - b);
      const outer = receiverKind(this.asset.manifest) === "view" ? Math.floor(values.length / 20) : 0;
      return [values[outer], values[values.length - 1 - outer]];
    });
    const center = ends.map(([least, most]) => (least + most) / 2) as unknown as Triple;
    return { center, radius: Math.max(1e-3, Math.hypot(...ends.map(([least, most]) => (most - least) / 2))) };
  }
}

const SAMPLES = 65_536;

/** Inverse of a rigid motion and uniform scale. */
export function inverse(m: Matrix4): Matrix4 {
  const scale = m[0][0] ** 2 + m[1][0] ** 2 + m[2][0] ** 2;
  const turn = [0, 1, 2].map((r) => [0, 1, 2].map((c) => m[c][r] / scale));
  const rows = turn.map((row) => [...row, -(row[0] * m[0][3] + row[1] * m[1][3] + row[2] * m[2][3])]);
  return [...rows, [0, 0, 0, 1]];
}
