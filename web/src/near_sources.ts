/**
 * Light from few surfels that reflect much of it, as beside a wall that a light is close to: in closed form, where few rays meet them.
 * The arithmetic of `srbf/visibility/near_sources.py`, which says why.
 */
import { SrbfError } from "./errors";
import type { FloatImage } from "./image";
import { dot, type Triple } from "./matrix";
import type { Occluders } from "./occluders";
import { type Cells, frame } from "./received_light";

const BRIGHT = 32; // of the mean radiosity, from which a surfel's light is taken out in part; from twice as much on, the whole
export const MOST = 256; // surfels, the brightest
const GROUPS = 4; // parts of the bright surfels, each seen or not as one
const FACING = 0.2; // m, that a unit of the normal counts where surfels are grouped
const OFF = 0.25; // of a group's size, how far from its surface it is seen
const [CLOSE, PARTS] = [8, 4]; // sides of a surfel, closer than which to a receiver it counts as so many parts a side
const LIFT = 1e-3; // of the extent of receivers
const SQUARINGS = 32; // of a matrix, until its longest axis alone is left

/** n surfels of a pool, those of a group after each other. */
export interface NearSources {
  readonly surfels: readonly number[];
  /** Which part of the light of each is taken out of the links. */
  readonly parts: readonly number[];
  /** The radiosity of that part, (n, 3). */
  readonly light: Float64Array;
  readonly groups: readonly Group[];
}

export interface Group {
  readonly first: number;
  readonly count: number;
  /** Where it is seen, m: a little way from its surface to the light. */
  readonly place: Triple;
}

/** The place (m) of a light, or the unit direction to a distant one; an environment is above each surface. */
export type Toward = { readonly place: Triple; readonly distant: boolean } | "above";

/** A pool of surfels some of which may be bright, and what these light. */
export class NearPool {
  readonly clusters: number;
  /** Of the view's clusters and, after these, of the surfels: places (m) and unit normals, (n, 3). */
  readonly places: Float64Array;
  readonly normals: Float64Array;
  /** How far above receivers their shadows are looked up, m. */
  readonly lift: number;
  /** Which surfels share their place with no other: translucent ones have a second one behind them. */
  private readonly alone: readonly boolean[];

  /** `points`: rows of the clusters' places and normals. @throws SrbfError on an image of another shape. */
  constructor(
    readonly cells: Cells,
    private readonly albedo: Float32Array,
    { width, height, channels, data }: FloatImage,
    clusters: number,
    where: string,
  ) {
    if (width !== clusters || height !== 2 || channels < 3) throw new SrbfError(`expected ${clusters} x 2 places in ${where}, found ${width} x ${height} x ${channels}`);
    this.clusters = clusters;
    const row = (y: number, own: Float64Array) => {
      const out = new Float64Array(3 * clusters + own.length);
      for (let i = 0; i < 3 * clusters; ++i) out[i] = data[channels * (y * clusters + Math.floor(i / 3)) + (i % 3)];
      out.set(own, 3 * clusters);
      return out;
    };
    this.places = row(0, cells.places);
    this.normals = row(1, cells.normals);
    this.lift = LIFT * extent(this.places);
    const keys = Array.from({ length: cells.count }, (_, i) => cells.places.subarray(3 * i, 3 * i + 3).join());
    const counts = new Map<string, number>();
    for (const key of keys) counts.set(key, (counts.get(key) ?? 0) + 1);
    this.alone = keys.map((key) => counts.get(key) === 1);
  }

  /** The surfels that are far brighter than the mean under a light of this `irradiance`, (S, 3); undefined where none is. */
  sources(irradiance: Float64Array, light: Toward): NearSources | undefined {
    const { areas, count } = this.cells;
    const first = (at: number) => this.albedo[at] * irradiance[at];
    const brightness = new Float64Array(count);
    let [sum, area] = [0, 0];
    for (let i = 0; i < count; ++i) {
      brightness[i] = (first(3 * i) + first(3 * i + 1) + first(3 * i + 2)) / 3;
      sum += brightness[i] * areas[i];
      area += areas[i];
    }
    let least = (BRIGHT * sum) / Math.max(area, 1e-30);
    let bright = [...brightness.keys()].filter((i) => brightness[i] > least);
    if (bright.length > MOST) {
      least = bright.map((i) => brightness[i]).sort((a, b) => b - a)[MOST];
      bright = bright.filter((i) => brightness[i] > least);
    }
    bright = bright.filter((i) => this.alone[i]);
    if (!bright.length) return undefined;
    const groups = this.grouped(bright, brightness);
    const surfels = groups.flat();
    const parts = surfels.map((i) => Math.min(1, brightness[i] / Math.max(least, 1e-30) - 1));
    const taken = Float64Array.from(surfels.flatMap((surfel, i) => [0, 1, 2].map((c) => parts[i] * first(3 * surfel + c))));
    let before = 0;
    const seen = groups.map((own) => {
      before += own.length;
      return { first: before - own.length, count: own.length, place: this.seenFrom(own, brightness, light) };
    });
    return { surfels, parts, light: taken, groups: seen };
  }

  /** What sources lay on all receivers, (n, 3). */
  irradiance({ surfels, light, groups }: NearSources, occluders: Occluders): Float64Array {
    const { cells, places, normals, lift } = this;
    const out = new Float64Array(places.length);
    for (let at = 0; at < places.length; at += 3) {
      const [x, y, z] = [places[at], places[at + 1], places[at + 2]];
      const [nx, ny, nz] = [normals[at], normals[at + 1], normals[at + 2]];
      const [sx, sy, sz] = [Math.fround(x + lift * nx), Math.fround(y + lift * ny), Math.fround(z + lift * nz)];
      for (const { first, count, place } of groups) {
        let [r, g, b] = [0, 0, 0];
        for (let i = first; i < first + count; ++i) {
          const s = 3 * surfels[i];
          const facing: Triple = [cells.normals[s], cells.normals[s + 1], cells.normals[s + 2]];
          const factor = discFactor([cells.places[s] - x, cells.places[s + 1] - y, cells.places[s + 2] - z], [nx, ny, nz], facing, cells.areas[surfels[i]]);
          if (factor === 0) continue;
          r += factor * light[3 * i];
          g += factor * light[3 * i + 1];
          b += factor * light[3 * i + 2];
        }
        if ((r === 0 && g === 0 && b === 0) || occluders.between(sx, sy, sz, place[0] - sx, place[1] - sy, place[2] - sz)) continue;
        out[at] += r;
        out[at + 1] += g;
        out[at + 2] += b;
      }
    }
    return out;
  }

  /** At most GROUPS, by halving the one that is spread most, along its longest axis. */
  private grouped(bright: readonly number[], brightness: Float64Array): number[][] {
    const { places, normals, areas } = this.cells;
    const groups = [[...bright]];
    while (groups.length < GROUPS) {
      const spreads = groups.map((own) => {
        const features = own.map((i) => [...places.subarray(3 * i, 3 * i + 3), ...normals.subarray(3 * i, 3 * i + 3).map((x) => FACING * x)]);
        return spreadOf(features, own.map((i) => brightness[i] * areas[i]));
      });
      const widest = spreads.reduce((best, { spread }, i) => (spread > spreads[best].spread ? i : best), 0);
      const { spread, along } = spreads[widest];
      if (spread <= 0) break;
      const own = groups[widest];
      groups[widest] = own.filter((_, i) => along[i] <= 0);
      groups.push(own.filter((_, i) => along[i] > 0));
    }
    return groups;
  }

  /** Where a group is seen. */
  private seenFrom(own: readonly number[], brightness: Float64Array, light: Toward): Triple {
    const { places, areas, normals } = this.cells;
    const middle = mean(own.map((i) => [...places.subarray(3 * i, 3 * i + 3)]), own.map((i) => brightness[i] * areas[i]));
    const away = own.map((i) => middle.reduce((sum, x, k) => sum + (places[3 * i + k] - x) ** 2, 0));
    const nearest = own[away.indexOf(Math.min(...away))];
    const place = [...places.subarray(3 * nearest, 3 * nearest + 3)];
    const above = light === "above" ? (normals.subarray(3 * nearest, 3 * nearest + 3) as unknown as Triple) : light.distant ? light.place : undefined;
    const vector = above ?? ((light as { place: Triple }).place.map((x, k) => x - place[k]) as unknown as Triple);
    const far = above ? Infinity : Math.sqrt(dot(vector, vector));
    const step = Math.min(OFF * Math.sqrt(own.reduce((sum, i) => sum + areas[i], 0)), far / 2) / (above ? 1 : Math.max(far, 1e-30));
    return place.map((x, k) => x + step * vector[k]) as unknown as Triple;
  }
}

/** `srbfDiscFactor`: what share of a receiver's light a source gives, as a disc; one close to it as a square of 4 x 4 discs. */
function discFactor(toward: Triple, normal: Triple, facing: Triple, area: number): number {
  const far = -dot(toward, facing);
  if (far <= 0) return 0;
  if (dot(toward, toward) >= CLOSE ** 2 * area) return (far * Math.max(0, dot(toward, normal)) * area) / spread(dot(toward, toward), area);
  const [tangent, bitangent] = frame(...facing);
  const [side, part] = [Math.sqrt(area), area / PARTS ** 2];
  let total = 0;
  for (let i = 0; i < PARTS ** 2; ++i) {
    const [s, t] = [side * ((Math.floor(i / PARTS) + 0.5) / PARTS - 0.5), side * (((i % PARTS) + 0.5) / PARTS - 0.5)];
    const there = toward.map((x, k) => x + s * tangent[k] + t * bitangent[k]) as unknown as Triple;
    total += (Math.max(0, dot(there, normal)) * part) / spread(dot(there, there), part);
  }
  return total * far;
}

const spread = (squared: number, area: number) => Math.max(squared, 1e-12) * (Math.PI * Math.max(squared, 1e-12) + area);

/** Irradiance on the surfels, (S, 3), without the part that is taken out of the links. */
export function without({ surfels, parts }: NearSources, irradiance: Float64Array): Float64Array {
  const out = irradiance.slice();
  surfels.forEach((surfel, i) => {
    for (let c = 0; c < 3; ++c) out[3 * surfel + c] *= 1 - parts[i];
  });
  return out;
}

/** How far points are from their weighted mean: in all, and each along the longest axis. */
function spreadOf(points: number[][], weights: number[]): { spread: number; along: number[] } {
  const middle = mean(points, weights);
  const off = points.map((point) => point.map((x, k) => x - middle[k]));
  const matrix = middle.map((_, i) => middle.map((_, j) => off.reduce((sum, d, n) => sum + weights[n] * d[i] * d[j], 0)));
  const spread = points.length > 1 ? matrix.reduce((sum, row, i) => sum + row[i], 0) : 0; // without rounding
  if (spread <= 0) return { spread, along: off.map(() => 0) };
  const axis = longestAxis(matrix);
  return { spread, along: off.map((d) => d.reduce((sum, x, k) => sum + x * axis[k], 0)) };
}

/** The eigenvector of the largest eigenvalue of a symmetric matrix without negative ones; its largest part is above 0. */
function longestAxis(matrix: number[][]): number[] {
  const trace = (m: number[][]) => m.reduce((sum, row, i) => sum + row[i], 0);
  let power = matrix;
  for (let i = 0; i < SQUARINGS; ++i) {
    const scale = 1 / trace(power) ** 2;
    power = power.map((row) => power.map((other) => scale * row.reduce((sum, x, k) => sum + x * other[k], 0)));
  }
  const diagonal = power.map((row, i) => row[i]);
  return power[diagonal.indexOf(Math.max(...diagonal))];
}

function mean(points: number[][], weights: number[]): number[] {
  const total = weights.reduce((sum, x) => sum + x, 0);
  return points[0].map((_, k) => points.reduce((sum, point, i) => sum + weights[i] * point[k], 0) / total);
}

/** The longest side of the box about places, m. */
function extent(places: Float64Array): number {
  const [least, most] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
  places.forEach((x, i) => {
    least[i % 3] = Math.min(least[i % 3], x);
    most[i % 3] = Math.max(most[i % 3], x);
  });
  return Math.max(...most.map((x, k) => x - least[k]));
}
