/** What a light lays on the patches of a scene's surfaces, by one shadow ray to each of their cells: `srbf/visibility/received.py`. */
import { SrbfError } from "./errors";
import type { FloatImage } from "./image";
import { rgb } from "./light_values";
import { type AreaLight, type DirectionalLight, type PunctualLight, unit } from "./lights";
import { cross, type Triple } from "./matrix";
import type { Occluders } from "./occluders";

import { profileLook } from "./point_light";
import type { EnvironmentDirections } from "./environment_directions";

export const FAR = 1e4; // meters: how far a distant light's shadow rays go
const OFFSET = 1e-4; // of the scene's size: between a surface and the end of a ray to it
export const SIDE = 4; // points per side of an area light
const [NEAR, PARTS] = [8, 4]; // sides of a cell, closer than which it is measured by so many points a side;
const [NEAR_CONE, WIDEST] = [64, -0.5]; // of a spot of a half-angle below one of that cosine, whose cone may end in it
const SOFTNESS_MIN = 1e-6; // in cosine, of a spot's edge

/** N cells of K patches: `cells.exr`. */
export class Cells {
  readonly count: number;
  readonly patches: number;
  /** (N, 3), m; `starts` of shadow rays are `lift` (m) above them. */
  readonly places: Float64Array;
  readonly lift: number;
  readonly starts: Float64Array;
  readonly normals: Float64Array;
  readonly areas: Float64Array;
  /** Patch of every cell. */
  readonly owners: Int32Array;
  readonly patchAreas: Float64Array;

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
    const lift = (this.lift = n ? OFFSET * Math.max(...most.map((x, k) => x - least[k])) : 0);
    for (let i = 0; i < 3 * n; ++i) this.starts[i] = Math.fround(this.places[i] + lift * this.normals[i]);
    this.patches = this.owners.reduce((largest, owner) => Math.max(largest, owner + 1), 0);
    this.patchAreas = new Float64Array(this.patches);
    this.owners.forEach((owner, i) => (this.patchAreas[owner] += this.areas[i]));
  }

  /** Mean irradiance of every patch under a light in white, (n, 3), 0 past the K patches; `far`: how far a distant light's shadow rays go, m. */
  under(light: PunctualLight | AreaLight | DirectionalLight | EnvironmentDirections, occluders: Occluders, far: number, n = this.patches): Float64Array {
    if (light.kind === "environment-directions") {
      const out = new Float64Array(3 * n);
      for (const [direction, color] of light.directions) {
        this.underDistant(direction, occluders, far).forEach((x, i) => {
          for (let c = 0; c < 3; ++c) out[3 * i + c] += x * color[c];
        });
      }
      return out;
    }
    if (light.kind === "area") return rgb(this.underArea(light, occluders), n);
    if (light.kind === "directional") return rgb(this.underDistant(light.direction, occluders, far), n);
    if (!light.profile || light.profile.gray) return rgb(this.underPoint(light, occluders), n);
    const known = new Int8Array(this.count); // of each cell: 0 not known, 1 seen, 2 hidden
    const colors = [0, 1, 2].map((c) => this.underPoint(light, occluders, c, known));
    return Float64Array.from({ length: 3 * n }, (_, i) => colors[i % 3][Math.floor(i / 3)] ?? 0);
  }

  /** Mean irradiance of every patch under a white point, spot or sphere light, (K,); `c`: which color of a profile; `known`: what cells see it. */
  private underPoint(light: PunctualLight, occluders: Occluders, c = 0, known = new Int8Array(this.count)): Float64Array {
    const shape = profileLook(light);
    const along = light.direction ?? [0, 0, -1];
    const out = new Float64Array(this.patches);
    const cone = light.kind === "spot" ? { inner: Math.cos(light.inner), outer: Math.cos(light.outer), axis: light.direction } : undefined;
    this.add(out, light.position, occluders, (squared, ux, uy, uz, least) => {
      const near = Math.max(squared, light.radius ** 2, least);
      const strength = light.falloff === "inverse-square" ? light.a0 ** 2 / near : light.a0 / Math.sqrt(near);
      const lit = cone ? strength * smooth(-(ux * cone.axis[0] + uy * cone.axis[1] + uz * cone.axis[2]), cone.inner, cone.outer) : strength;
      if (!shape || lit <= 0) return lit;
      const away = ([x, y, z]: Triple) => -(ux * x + uy * y + uz * z);
      return lit * shape.profile.at(away(shape.across), away(shape.up), away(along), shape.tangent, c);
    }, cone && cone.outer > WIDEST ? NEAR_CONE : NEAR, known);
    return this.means(out);
  }

  /** Mean irradiance of every patch under a white one-sided Lambertian rectangle: the mean of a grid of its points. */
  private underArea({ position, u, v, a0 }: AreaLight, occluders: Occluders): Float64Array {
    const out = new Float64Array(this.patches);
    const [fx, fy, fz] = unit(cross(u, v));
    for (let i = 0; i < SIDE ** 2; ++i) {
      const [s, t] = [(Math.floor(i / SIDE) + 0.5) / SIDE - 0.5, ((i % SIDE) + 0.5) / SIDE - 0.5];
      const place = [0, 1, 2].map((k) => position[k] + s * u[k] + t * v[k]) as unknown as Triple;
      this.add(out, place, occluders, (squared, ux, uy, uz, least) => (Math.max(0, -(ux * fx + uy * fy + uz * fz)) * a0 ** 2) / Math.max(squared, least) / SIDE ** 2);
    }
    return this.means(out);
  }

  /** Mean irradiance of every patch under a white directional light. */
  private underDistant(direction: Triple, occluders: Occluders, far: number): Float64Array {
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

  /**
   * Area times the mean of cosine times `strength` of every cell that sees `place`, added to its patch: by PARTS x PARTS points of cells
   * closer than so many sides. The unit vector to the place is (ux, uy, uz).
   */
  private add(
    out: Float64Array,
    place: Triple,
    occluders: Occluders,
    strength: (squared: number, ux: number, uy: number, uz: number, least: number) => number,
    sides = NEAR,
    known = new Int8Array(this.count),
  ): void {
    const { places, starts, normals, areas, owners } = this;
    for (let i = 0; i < this.count; ++i) {
      const at = 3 * i;
      const [x, y, z] = [place[0] - places[at], place[1] - places[at + 1], place[2] - places[at + 2]];
      const [nx, ny, nz] = [normals[at], normals[at + 1], normals[at + 2]];
      const falling = (dx: number, dy: number, dz: number, least: number): number => {
        const toward = dx * nx + dy * ny + dz * nz;
        if (toward <= 0) return 0;
        const squared = dx * dx + dy * dy + dz * dz;
        const distance = Math.sqrt(Math.max(squared, 1e-30));
        return (toward / distance) * strength(squared, dx / distance, dy / distance, dz / distance, least);
      };
      const least = areas[i] / (2 * Math.PI);
      let amount = 0;
      if (x * x + y * y + z * z < sides ** 2 * areas[i]) {
        const [[tx, ty, tz], [bx, by, bz]] = frame(nx, ny, nz);
        const side = Math.sqrt(areas[i]);
        for (let part = 0; part < PARTS ** 2; ++part) {
          const s = side * ((Math.floor(part / PARTS) + 0.5) / PARTS - 0.5);
          const t = side * (((part % PARTS) + 0.5) / PARTS - 0.5);
          amount += falling(x - s * tx - t * bx, y - s * ty - t * by, z - s * tz - t * bz, least / PARTS ** 2);
        }
        amount /= PARTS ** 2;
      } else amount = falling(x, y, z, least);
      if (amount <= 0) continue;
      const [sx, sy, sz] = [starts[at], starts[at + 1], starts[at + 2]];
      known[i] ||= occluders.between(sx, sy, sz, place[0] - sx, place[1] - sy, place[2] - sz) ? 2 : 1;
      if (known[i] === 1) out[owners[i]] += areas[i] * amount;
    }
  }

  private means(sums: Float64Array): Float64Array {
    return sums.map((sum, k) => sum / Math.max(this.patchAreas[k], 1e-30));
  }
}

/** Two unit vectors across a normal and each other, as the Python library has them [Duff2017]. */
export function frame(x: number, y: number, z: number): [Triple, Triple] {
  const sign = z >= 0 ? 1 : -1;
  const a = -1 / (sign + z);
  const b = x * y * a;
  return [
    [1 + sign * x * x * a, sign * b, -sign * x],
    [b, sign + y * y * a, -y],
  ];
}

function smooth(cosine: number, inner: number, outer: number): number {
  const t = Math.min(1, Math.max(0, (cosine - outer) / Math.max(inner - outer, SOFTNESS_MIN)));
  return t * t * (3 - 2 * t);
}
