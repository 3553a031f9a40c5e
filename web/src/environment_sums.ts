/** Sums of a spherical function's values about fixed centers over the texels of environment maps. A large map is blurred once, and read at the centers each time it turns. */
import type { DistantLight } from "./asset_frame";
import { environmentSamples, environmentTexels, isUpright, mapFrame } from "./environment";
import { gaussian } from "./gaussian";
import type { EnvironmentLight } from "./lights";
import { dot, IDENTITY, type Matrix4, type Triple, turned } from "./matrix";

const FEW = 5e5; // texels times centers, up to which every texel is weighed at every center
const PER_SPREAD = 3; // rows of a blurred map per spread; twice as many of the map that is blurred
const REACH = 4.5; // spreads, beyond which a Gaussian counts as 0

/** Sums over lights of color times R(direction . center), R a Gaussian of one `spread` (rad). */
export class GaussianSums {
  private readonly maps = new WeakMap<object, { blurred?: BlurredMap; frame: string; sums: Float64Array }>(); // by their pixels: what was summed last

  /** `weight`: R of the cosine, by the formula unless given. */
  constructor(
    private readonly centers: readonly Triple[],
    private readonly spread: number,
    private readonly region: "sphere" | "hemisphere",
    private readonly weight: (cosine: number) => number = (cosine) => gaussian(cosine, spread),
  ) {}

  /** Add distant lights to `sums`, (centers, 3). */
  addDistant(lights: Iterable<DistantLight>, sums: Float64Array): void {
    for (const [direction, color] of lights) {
      for (let i = 0; i < this.centers.length; ++i) {
        const weight = this.weight(dot(direction, this.centers[i]));
        for (let c = 0; c < 3; ++c) sums[3 * i + c] += weight * color[c];
      }
    }
  }

  /** Add a map. Where it has many texels, sums are off by up to 0.005 of the largest one under a sun of a single texel, by 0.0001 without. */
  addEnvironment(light: EnvironmentLight, assetFromWorld: Matrix4, sums: Float64Array): void {
    const key = light.pixels as object;
    const frame = mapFrame(light, assetFromWorld);
    const known = this.maps.get(key) ?? { frame: "", sums: new Float64Array(sums.length) };
    this.maps.set(key, known);
    if (known.frame !== String(frame)) {
      known.sums.fill(0);
      if (light.width * light.height * this.centers.length <= FEW || (this.region === "hemisphere" && !isUpright(frame))) {
        this.addDistant(environmentSamples({ ...light, color: [1, 1, 1] }, this.region, assetFromWorld), known.sums);
      } else {
        known.blurred ??= new BlurredMap(light, this.spread, this.region);
        const inverse = frame[0].map((_, i) => frame.map((row) => row[i])); // of the turn, and scaled, which does not count
        for (let i = 0; i < this.centers.length; ++i) known.blurred.add(turned(inverse, this.centers[i]), known.sums, 3 * i);
      }
      known.frame = String(frame);
    }
    for (let i = 0; i < sums.length; ++i) sums[i] += known.sums[i] * light.color[i % 3];
  }
}

/** A map's radiance times solid angle, blurred by a Gaussian, on a grid of rows and columns like the map's. */
class BlurredMap {
  private readonly rows: number;
  private readonly values: Float32Array; // (rows + 4, 2 rows + 4, 3): two more at each side, past the poles and around

  constructor(map: EnvironmentLight, spread: number, region: "sphere" | "hemisphere") {
    this.rows = Math.max(8, Math.ceil((Math.PI * PER_SPREAD) / spread));
    this.values = this.framed(blur(fine(map, this.rows, region), this.rows, spread, REACH * spread));
  }

  /** Add the value in a direction of the map's own frame, of any length, by cubic interpolation. */
  add([x, y, z]: Triple, sums: Float64Array, at: number): void {
    const { rows, values } = this;
    const width = 2 * rows + 4;
    const row = (0.5 - Math.atan2(z, Math.hypot(x, y)) / Math.PI) * rows - 0.5;
    const column = (0.5 - Math.atan2(y, x) / (2 * Math.PI)) * 2 * rows - 0.5;
    const [top, left] = [Math.floor(row), Math.floor(column)];
    const [down, across] = [cubic(row - top), cubic(column - left)];
    for (let i = 0; i < 4; ++i) {
      for (let j = 0; j < 4; ++j) {
        const weight = down[i] * across[j];
        const from = 3 * ((top + 1 + i) * width + left + 1 + j);
        for (let c = 0; c < 3; ++c) sums[at + c] += weight * values[from + c];
      }
    }
  }

  /** Two rows past each pole, on the other side of it, and two columns around. */
  private framed(values: Float32Array): Float32Array {
    const { rows } = this;
    const columns = 2 * rows;
    const out = new Float32Array((rows + 4) * (columns + 4) * 3);
    for (let i = 0; i < rows + 4; ++i) {
      const row = i - 2;
      const past = row < 0 || row >= rows;
      const from = row < 0 ? -1 - row : past ? 2 * rows - 1 - row : row;
      for (let j = 0; j < columns + 4; ++j) {
        const column = (j - 2 + columns + (past ? rows : 0)) % columns;
        for (let c = 0; c < 3; ++c) out[3 * (i * (columns + 4) + j) + c] = values[3 * (from * columns + column) + c];
      }
    }
    return out;
  }
}

/** Lagrange's weights of the values at -1, 0, 1, 2 for one at t. */
const cubic = (t: number) => [(-t * (t - 1) * (t - 2)) / 6, ((t + 1) * (t - 1) * (t - 2)) / 2, (-(t + 1) * t * (t - 2)) / 2, ((t + 1) * t * (t - 1)) / 6];

/** Radiance times solid angle of a map on a grid of 2 `rows` times 4 `rows` texels, (texels, 3): each of the map shared among the sixteen nearest, which keeps its place and width. */
function fine({ width, height, pixels }: EnvironmentLight, rows: number, region: "sphere" | "hemisphere"): Float32Array {
  const [down, across] = [2 * rows, 4 * rows];
  const out = new Float32Array(down * across * 3);
  for (const { direction, solidAngle, row, column } of environmentTexels(width, height, region, IDENTITY)) {
    const from = 3 * (row * width + column);
    const v = (0.5 - Math.asin(Math.min(1, Math.max(-1, direction[2]))) / Math.PI) * down - 0.5;
    const u = ((column + 0.5) / width) * across - 0.5;
    const [top, left] = [Math.floor(v), Math.floor(u)];
    const [shares, parts] = [cubic(v - top), cubic(u - left)];
    for (let i = 0; i < 4; ++i) {
      const y = top - 1 + i;
      const past = y < 0 || y >= down; // a pole, to the other side
      const start = (y < 0 ? -1 - y : past ? 2 * down - 1 - y : y) * across;
      for (let j = 0; j < 4; ++j) {
        const x = (left - 1 + j + across + (past ? down : 0)) % across;
        const share = shares[i] * parts[j] * solidAngle;
        for (let c = 0; c < 3; ++c) out[3 * (start + x) + c] += share * pixels[from + c];
      }
    }
  }
  return out;
}

/** Sums of Gaussians over a `fine` grid, on one of half its rows and columns, (rows, 2 rows, 3). */
function blur(from: Float32Array, rows: number, spread: number, reach: number): Float32Array {
  const [columns, across] = [2 * rows, 4 * rows];
  const out = new Float32Array(rows * columns * 3);
  const step = Math.PI / (2 * rows); // of the fine grid
  const kernel = new Float32Array(columns);
  const wrapped = new Float32Array(3 * across * 3); // a row of the grid, three times over
  for (let source = 0; source < 2 * rows; ++source) {
    const row = from.subarray(3 * source * across, 3 * (source + 1) * across);
    if (row.every((value) => value === 0)) continue;
    for (let k = 0; k < 3; ++k) wrapped.set(row, k * row.length);
    const elevation = Math.PI / 2 - (source + 0.5) * step;
    const first = Math.max(0, Math.ceil((source + 0.5 - reach / step) / 2 - 0.5));
    const last = Math.min(rows - 1, Math.floor((source + 0.5 + reach / step) / 2 - 0.5));
    for (let target = first; target <= last; ++target) {
      const other = Math.PI / 2 - (2 * target + 1) * step;
      const count = kernelOf(kernel, elevation, other, step, spread, reach);
      for (let j = 0; j < columns; ++j) {
        const right = 3 * (across + 2 * j + 1); // the target's middle is between two texels of the fine grid
        let [r, g, b] = [0, 0, 0];
        for (let q = 0, a = right, z = right - 3; q < count; ++q, a += 3, z -= 3) {
          r += kernel[q] * (wrapped[a] + wrapped[z]);
          g += kernel[q] * (wrapped[a + 1] + wrapped[z + 1]);
          b += kernel[q] * (wrapped[a + 2] + wrapped[z + 2]);
        }
        const to = 3 * (target * columns + j);
        out[to] += r;
        out[to + 1] += g;
        out[to + 2] += b;
      }
    }
  }
  return out;
}

/** Gaussians from one elevation to another at 1/2, 3/2, ... steps of azimuth, up to half a turn; how many are within reach. */
function kernelOf(kernel: Float32Array, from: number, to: number, step: number, spread: number, reach: number): number {
  const [same, apart] = [Math.sin(from) * Math.sin(to), Math.cos(from) * Math.cos(to)];
  const least = Math.cos(Math.min(reach, Math.PI));
  for (let q = 0; q < kernel.length; ++q) {
    const cosine = same + apart * Math.cos((q + 0.5) * step);
    if (cosine < least) return q;
    kernel[q] = gaussian(cosine, spread);
  }
  return kernel.length;
}
