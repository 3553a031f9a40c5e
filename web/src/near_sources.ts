/**
 * Light from few surfels that reflect much of it, as beside a wall that a light is close to: in closed form, where few rays meet them.
 * The arithmetic of `srbf/visibility/near_sources.py`, which says why.
 */
import { SrbfError } from "./errors";
import type { FloatImage } from "./image";
import type { Triple } from "./matrix";
import type { Occluders } from "./occluders";
import type { NearCells } from "./near_cells";
import { type Cells, frame } from "./received_light";

const BRIGHT = 32; // of the mean radiosity, from which a surfel's light is taken out in part; from twice as much on, the whole
const MOST = 256; // surfels, the brightest
export const ENTRIES = 2 * MOST; // surfels, each by two cells
const [CLOSE, PARTS] = [8, 4]; // sides of a surfel, closer than which to a receiver it counts as so many parts a side
const LIFT = 1e-3; // of the extent of receivers
const KEPT = 256; // cells of which it is known what sees them

/** n surfels of a pool. */
export interface NearSources {
  readonly surfels: readonly number[];
  /** Which part of the light of each is taken out of the links. */
  readonly parts: readonly number[];
  readonly cells: readonly SendingCell[];
}

/** What is sent from surfels that are seen by one cell. */
export interface SendingCell {
  readonly cell: number;
  /** Numbers among the sources' surfels. */
  readonly members: readonly number[];
  /** Which part of the light of each is sent by this cell. */
  readonly shares: readonly number[];
  /** Their radiosity, that part of it. */
  readonly light: readonly Triple[];
}

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
  /** What the receivers see of cells. */
  private readonly known = new Map<number, Uint8Array>();

  /** `points`: rows of the clusters' places and normals. @throws SrbfError on an image of another shape. */
  constructor(
    readonly cells: Cells,
    readonly near: NearCells,
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

  /** The surfels that are far brighter than the mean under a light of this `irradiance`, (S, 3), at a `place` (m), if it has one; undefined where none is. */
  sources(irradiance: Float64Array, place?: Triple): NearSources | undefined {
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
    const parts = bright.map((i) => Math.min(1, brightness[i] / Math.max(least, 1e-30) - 1));
    const places = bright.map((i) => [...this.cells.places.subarray(3 * i, 3 * i + 3)] as unknown as Triple);
    const shares = this.near.seen(bright, places, bright.map((i) => brightness[i] * areas[i]), place);
    const sending = new Map<number, { members: number[]; shares: number[]; light: Triple[] }>();
    shares.forEach((own, i) => {
      for (const [cell, share] of own) {
        const sent = sending.get(cell) ?? { members: [], shares: [], light: [] };
        sending.set(cell, sent);
        sent.members.push(i);
        sent.shares.push(share * parts[i]);
        sent.light.push([0, 1, 2].map((c) => share * parts[i] * first(3 * bright[i] + c)) as unknown as Triple);
      }
    });
    return { surfels: bright, parts, cells: [...sending].sort(([one], [other]) => one - other).map(([cell, sent]) => ({ cell, ...sent })) };
  }

  /** What sources lay on all receivers, (n, 3). */
  irradiance({ surfels, cells: sending }: NearSources, occluders: Occluders): Float64Array {
    const { cells, places, normals } = this;
    const out = new Float64Array(places.length);
    const seen = sending.map(({ cell }) => this.seen(cell, occluders));
    const sources = surfels.map((surfel) => new Source(cells, surfel));
    const factors = new Float64Array(surfels.length);
    for (let at = 0; at < places.length; at += 3) {
      if (!seen.some((own) => own[at / 3] === 1)) continue;
      sources.forEach((source, i) => {
        factors[i] = source.factor(places[at], places[at + 1], places[at + 2], normals[at], normals[at + 1], normals[at + 2]);
      });
      sending.forEach(({ members, light }, number) => {
        if (seen[number][at / 3] === 0) return;
        members.forEach((member, i) => {
          for (let c = 0; c < 3; ++c) out[at + c] += factors[member] * light[i][c];
        });
      });
    }
    return out;
  }

  /** 1 for each receiver that sees a cell. */
  private seen(cell: number, occluders: Occluders): Uint8Array {
    const { places, normals, lift, known } = this;
    const found = known.get(cell) ?? new Uint8Array(places.length / 3);
    if (!known.has(cell)) {
      const place = this.near.place(cell);
      for (let i = 0; i < found.length; ++i) {
        const [x, y, z] = [0, 1, 2].map((k) => Math.fround(places[3 * i + k] + lift * normals[3 * i + k]));
        found[i] = occluders.between(x, y, z, place[0] - x, place[1] - y, place[2] - z) ? 0 : 1;
      }
    }
    known.delete(cell);
    known.set(cell, found); // the last in order
    for (const first of known.keys()) {
      if (known.size <= KEPT) break;
      known.delete(first);
    }
    return found;
  }
}

/** A surfel that lights others. */
class Source {
  private readonly place: Triple;
  private readonly facing: Triple;
  private readonly area: number;
  private readonly tangents: readonly [Triple, Triple];

  constructor({ places, normals, areas }: Cells, surfel: number) {
    const own = (values: Float64Array) => [values[3 * surfel], values[3 * surfel + 1], values[3 * surfel + 2]] as const;
    this.place = own(places);
    this.facing = own(normals);
    this.area = areas[surfel];
    this.tangents = frame(...this.facing);
  }

  /** `srbfDiscFactor`: what share of the light at a place (x, y, z) of this normal it gives, as a disc; close to it as a square of 4 x 4 discs. */
  factor(x: number, y: number, z: number, nx: number, ny: number, nz: number): number {
    const { place, facing, area, tangents } = this;
    const [dx, dy, dz] = [place[0] - x, place[1] - y, place[2] - z];
    const far = -(dx * facing[0] + dy * facing[1] + dz * facing[2]);
    if (far <= 0) return 0;
    const [height, squared] = [dx * nx + dy * ny + dz * nz, dx * dx + dy * dy + dz * dz];
    if (squared >= CLOSE ** 2 * area) return (far * Math.max(0, height) * area) / spread(squared, area);
    const [[tx, ty, tz], [bx, by, bz]] = tangents;
    const [side, part] = [Math.sqrt(area), area / PARTS ** 2];
    let total = 0;
    for (let i = 0; i < PARTS ** 2; ++i) {
      const s = side * ((Math.floor(i / PARTS) + 0.5) / PARTS - 0.5);
      const t = side * (((i % PARTS) + 0.5) / PARTS - 0.5);
      const [ox, oy, oz] = [dx + s * tx + t * bx, dy + s * ty + t * by, dz + s * tz + t * bz];
      total += (Math.max(0, ox * nx + oy * ny + oz * nz) * part) / spread(ox * ox + oy * oy + oz * oz, part);
    }
    return total * far;
  }
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

/** The longest side of the box about places, m. */
function extent(places: Float64Array): number {
  const [least, most] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
  places.forEach((x, i) => {
    least[i % 3] = Math.min(least[i % 3], x);
    most[i % 3] = Math.max(most[i % 3], x);
  });
  return Math.max(...most.map((x, k) => x - least[k]));
}
