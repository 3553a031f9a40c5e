/** Where an asset's texels are lit: four points of each texel's footprint, with their normals, as in `srbf/visibility/receivers.py`. */
import type { Asset, FloatImage } from "../src";

const SAME_SURFACE_COS = 0.9; // of the normals of two neighbors that lie on one smooth surface
const OFF_PLANE = 0.2; // of their distance: how far a neighbor may lie off the tangent plane
const LONGER = 2.0; // a neighbor farther away than this many times the opposite one lies across a seam
const FEW = 1 << 14; // texels
const BLOCK = 8; // texels per side
const CORNERS = [
  [-0.25, -0.25],
  [0.25, -0.25],
  [-0.25, 0.25],
  [0.25, 0.25],
];

/** Points less `center`, and unit normals, RGBA floats of every texel. */
export interface LitPoints {
  points: Float32Array;
  normals: Float32Array;
}

export interface DirectReceivers {
  /** Meters, of the covered texels: single precision is finest about the origin. */
  center: [number, number, number];
  corners: LitPoints[];
  /** Points, xyz, whose bounds along any axis contain those of all covered texels' points. */
  bounds: Float32Array;
}

/** The points of a grid that is `factor` times finer than the asset's in both directions: one point for each texel, and the same bounds. */
export function fineReceivers(asset: Asset, position: FloatImage, normal: FloatImage, coverage: FloatImage | undefined, factor: number): DirectReceivers {
  const { center, bounds } = directReceivers(asset, position, normal, coverage, 1);
  const { width, height } = asset.manifest;
  const real = (i: number) => coverage === undefined || coverage.data[coverage.channels * i] > 0;
  const along = gradients(width, height, position, normal, real);
  const points = new Float32Array(4 * factor ** 2 * width * height);
  const normals = new Float32Array(points.length);
  const turned = [0, 0, 0];
  for (let row = 0, at = 0; row < factor * height; ++row) {
    const y = ((row % factor) + 0.5) / factor - 0.5;
    for (let column = 0; column < factor * width; ++column, at += 4) {
      const x = ((column % factor) + 0.5) / factor - 0.5;
      const i = Math.floor(row / factor) * width + Math.floor(column / factor);
      for (let c = 0; c < 3; ++c) {
        points[at + c] = position.data[position.channels * i + c] - center[c] + x * along.position[0][3 * i + c] + y * along.position[1][3 * i + c];
        turned[c] = normal.data[normal.channels * i + c] + x * along.normal[0][3 * i + c] + y * along.normal[1][3 * i + c];
      }
      const length = Math.max(Math.hypot(turned[0], turned[1], turned[2]), 1e-20);
      for (let c = 0; c < 3; ++c) normals[at + c] = turned[c] / length;
    }
  }
  return { center, corners: [{ points, normals }], bounds };
}

/** The points at which `asset` is lit; `footprint` is the fraction of a texel's side that they span. */
export function directReceivers(asset: Asset, position: FloatImage, normal: FloatImage, coverage: FloatImage | undefined, footprint: number): DirectReceivers {
  const { width, height } = asset.manifest;
  const real = (i: number) => coverage === undefined || coverage.data[coverage.channels * i] > 0;
  const some = coverage === undefined || coverage.data.some((value, i) => i % coverage.channels === 0 && value > 0);
  const covered = some ? real : () => true;
  const center: [number, number, number] = [0, 0, 0];
  let count = 0;
  for (let i = 0; i < width * height; ++i) {
    if (!covered(i)) continue;
    for (let c = 0; c < 3; ++c) center[c] += position.data[position.channels * i + c];
    ++count;
  }
  for (let c = 0; c < 3; ++c) center[c] /= count;
  const along = gradients(width, height, position, normal, real);
  const corners = CORNERS.map(([x, y]) => {
    const points = new Float32Array(4 * width * height);
    const normals = new Float32Array(4 * width * height);
    for (let i = 0; i < width * height; ++i) {
      const turned = [0, 0, 0];
      for (let c = 0; c < 3; ++c) {
        points[4 * i + c] = position.data[position.channels * i + c] - center[c] + footprint * (x * along.position[0][3 * i + c] + y * along.position[1][3 * i + c]);
        turned[c] = normal.data[normal.channels * i + c] + footprint * (x * along.normal[0][3 * i + c] + y * along.normal[1][3 * i + c]);
      }
      const length = Math.max(Math.hypot(...turned), 1e-20);
      for (let c = 0; c < 3; ++c) normals[4 * i + c] = turned[c] / length;
    }
    return { points, normals };
  });
  return { center, corners, bounds: bounding(width, height, corners, covered) };
}

/** All points where they are few, else the corners of a box about each block of texels. */
function bounding(width: number, height: number, corners: readonly LitPoints[], covered: (texel: number) => boolean): Float32Array {
  const block = width * height <= FEW ? 1 : BLOCK;
  const out: number[] = [];
  for (let top = 0; top < height; top += block) {
    for (let left = 0; left < width; left += block) {
      const least = [Infinity, Infinity, Infinity];
      const most = [-Infinity, -Infinity, -Infinity];
      for (let r = top; r < Math.min(top + block, height); ++r) {
        for (let c = left; c < Math.min(left + block, width); ++c) {
          if (!covered(r * width + c)) continue;
          for (const { points } of corners) {
            const at = 4 * (r * width + c);
            if (block === 1) out.push(points[at], points[at + 1], points[at + 2]);
            for (let k = 0; k < 3; ++k) {
              least[k] = Math.min(least[k], points[at + k]);
              most[k] = Math.max(most[k], points[at + k]);
            }
          }
        }
      }
      if (block === 1 || least[0] > most[0]) continue;
      for (let i = 0; i < 8; ++i) out.push(i & 1 ? most[0] : least[0], i & 2 ? most[1] : least[1], i & 4 ? most[2] : least[2]);
    }
  }
  return new Float32Array(out);
}

type Pair = [Float32Array, Float32Array];

/** Change of position and normal per texel to the right and per texel down; 0 where no neighbor lies on the same surface. */
function gradients(width: number, height: number, position: FloatImage, normal: FloatImage, real: (i: number) => boolean): { position: Pair; normal: Pair } {
  const of = (image: FloatImage, i: number, c: number) => image.data[image.channels * i + c];
  const pair = (): Pair => [new Float32Array(3 * width * height), new Float32Array(3 * width * height)];
  const found = { position: pair(), normal: pair() };
  /** The neighbor's index, and how far it is where it lies on the same surface, else -1. */
  const neighbor = (r: number, c: number, axis: number, sign: number): { at: number; length: number; same: boolean } => {
    const [row, column] = axis === 0 ? [r, c + sign] : [r + sign, c];
    const i = r * width + c;
    if (row < 0 || column < 0 || row >= height || column >= width) return { at: i, length: 0, same: false };
    const at = row * width + column;
    let length = 0;
    let off = 0;
    let cosine = 0;
    for (let k = 0; k < 3; ++k) {
      const step = of(position, at, k) - of(position, i, k);
      length += step * step;
      off += step * of(normal, i, k);
      cosine += of(normal, at, k) * of(normal, i, k);
    }
    length = Math.sqrt(length);
    return { at, length, same: Math.abs(off) <= OFF_PLANE * length && cosine >= SAME_SURFACE_COS && length > 0 && real(i) && real(at) };
  };
  for (let r = 0; r < height; ++r) {
    for (let c = 0; c < width; ++c) {
      const i = r * width + c;
      for (const axis of [0, 1]) {
        const [ahead, behind] = [neighbor(r, c, axis, 1), neighbor(r, c, axis, -1)];
        const useAhead = ahead.same && !(behind.same && ahead.length > LONGER * behind.length);
        const useBehind = behind.same && !(useAhead && behind.length > LONGER * ahead.length);
        const weight = Math.max(1, Number(useAhead) + Number(useBehind));
        for (const [image, out] of [[position, found.position], [normal, found.normal]] as const) {
          for (let k = 0; k < 3; ++k) {
            const forward = useAhead ? of(image, ahead.at, k) - of(image, i, k) : 0;
            const backward = useBehind ? of(image, i, k) - of(image, behind.at, k) : 0;
            out[axis][3 * i + k] = (forward + backward) / weight;
          }
        }
      }
    }
  }
  return found;
}
