/** What a light lays on the patches of a scene's surfaces, by one shadow ray to each of their cells: `srbf/visibility/received.py`. */
import { SrbfError } from "./errors";
import type { FloatImage } from "./image";
import { type AreaLight, type PunctualLight, unit } from "./lights";
import { cross, type Triple } from "./matrix";
import type { Occluders } from "./occluders";

const OFFSET = 1e-4; // of the scene's size: between a surface and the end of a ray to it
const SIDE = 4; // points per side of an area light
const SOFTNESS_MIN = 1e-6; // in cosine, of a spot's edge

/** N cells of K patches: `cells.exr`. */
export class Cells {
  readonly count: number;
  readonly patches: number;
  private readonly places: Float64Array;
  private readonly starts: Float64Array;
  private readonly normals: Float64Array;
  private readonly areas: Float64Array;
  private readonly owners: Int32Array;
  private readonly patchAreas: Float64Array;

  /** `image`: row 0 (x, y, z, area), row 1 (normal, patch). @throws SrbfError on an image of another shape. */
  constructor({ width, height, channels, data }: FloatImage, where: string) {
    if (height !== 2 || channels !== 4) throw new SrbfError(`expected two rows of four numbers in ${where}, found ${width} x ${height} x ${channels}`);
    const n = (this.count = width);
    this.places = new Float64Array(3 * n);
    this.starts = new Float64Array(3 * n);
    this.normals = new Float64Array(3 * n);
    this.areas = new Float64Array(n);
    this.owners = new Int32Array(n);
    const [least, most] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
    for (let i = 0; i < n; ++i) {
      for (let k = 0; k < 3; ++k) {
        const x = (this.places[3 * i + k] = data[4 * i + k]);
        this.normals[3 * i + k] = data[4 * (n + i) + k];
        least[k] = Math.min(least[k], x);
        most[k] = Math.max(most[k], x);
      }
      this.areas[i] = data[4 * i + 3];
      this.owners[i] = Math.round(data[4 * (n + i) + 3]);
    }
    const lift = n ? OFFSET * Math.max(...most.map((x, k) => x - least[k])) : 0;
    for (let i = 0; i < 3 * n; ++i) this.starts[i] = Math.fround(this.places[i] + lift * this.normals[i]);
    this.patches = this.owners.reduce((largest, owner) => Math.max(largest, owner + 1), 0);
    this.patchAreas = new Float64Array(this.patches);
    this.owners.forEach((owner, i) => (this.patchAreas[owner] += this.areas[i]));
  }

  /** Mean irradiance of every patch under a white point, spot or sphere light, (K,). */
  underPoint(light: PunctualLight, occluders: Occluders): Float64Array {
    const out = new Float64Array(this.patches);
    const cone = light.kind === "spot" ? { inner: Math.cos(light.inner), outer: Math.cos(light.outer), axis: light.direction } : undefined;
    this.add(out, light.position, occluders, (squared, ux, uy, uz, spread) => {
      const near = Math.max(squared, light.radius ** 2) + spread;
      const strength = light.falloff === "inverse-square" ? light.a0 ** 2 / near : light.a0 / Math.sqrt(near);
      return cone ? strength * smooth(-(ux * cone.axis[0] + uy * cone.axis[1] + uz * cone.axis[2]), cone.inner, cone.outer) : strength;
    });
    return this.means(out);
  }

  /** Mean irradiance of every patch under a white one-sided Lambertian rectangle: the mean of a grid of its points. */
  underArea({ position, u, v, a0 }: AreaLight, occluders: Occluders): Float64Array {
    const out = new Float64Array(this.patches);
    const [fx, fy, fz] = unit(cross(u, v));
    for (let i = 0; i < SIDE ** 2; ++i) {
      const [s, t] = [(Math.floor(i / SIDE) + 0.5) / SIDE - 0.5, ((i % SIDE) + 0.5) / SIDE - 0.5];
      const place = [0, 1, 2].map((k) => position[k] + s * u[k] + t * v[k]) as unknown as Triple;
      this.add(out, place, occluders, (squared, ux, uy, uz, spread) => (Math.max(0, -(ux * fx + uy * fy + uz * fz)) * a0 ** 2) / (squared + spread) / SIDE ** 2);
    }
    return this.means(out);
  }

  /** Mean irradiance of every patch under a white directional light. */
  underDistant(direction: Triple, occluders: Occluders, far: number): Float64Array {
    const out = new Float64Array(this.patches);
    const [dx, dy, dz] = direction;
    for (let i = 0; i < this.count; ++i) {
      const at = 3 * i;
      const cosine = this.normals[at] * dx + this.normals[at + 1] * dy + this.normals[at + 2] * dz;
      if (cosine <= 0 || occluders.between(this.starts[at], this.starts[at + 1], this.starts[at + 2], far * dx, far * dy, far * dz)) continue;
      out[this.owners[i]] += this.areas[i] * cosine;
    }
    return this.means(out);
  }

  /** Area times cosine times `strength` of every cell that sees `place`, added to its patch. The unit vector to the place is (ux, uy, uz). */
  private add(
    out: Float64Array,
    place: Triple,
    occluders: Occluders,
    strength: (squared: number, ux: number, uy: number, uz: number, spread: number) => number,
  ): void {
    const { places, starts, normals, areas, owners } = this;
    for (let i = 0; i < this.count; ++i) {
      const at = 3 * i;
      const [x, y, z] = [place[0] - places[at], place[1] - places[at + 1], place[2] - places[at + 2]];
      const toward = x * normals[at] + y * normals[at + 1] + z * normals[at + 2];
      if (toward <= 0) continue;
      const squared = x * x + y * y + z * z;
      const distance = Math.sqrt(Math.max(squared, 1e-30));
      const amount = (toward / distance) * strength(squared, x / distance, y / distance, z / distance, areas[i] / Math.PI);
      if (amount <= 0) continue;
      const [sx, sy, sz] = [starts[at], starts[at + 1], starts[at + 2]];
      if (!occluders.between(sx, sy, sz, place[0] - sx, place[1] - sy, place[2] - sz)) out[owners[i]] += areas[i] * amount;
    }
  }

  private means(sums: Float64Array): Float64Array {
    return sums.map((sum, k) => sum / Math.max(this.patchAreas[k], 1e-30));
  }
}

function smooth(cosine: number, inner: number, outer: number): number {
  const t = Math.min(1, Math.max(0, (cosine - outer) / Math.max(inner - outer, SOFTNESS_MIN)));
  return t * t * (3 - 2 * t);
}
