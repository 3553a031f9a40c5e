/** An equirectangular map as many directional lights: `srbf.light_geometry.environment_samples`. */
import type { DistantLight } from "./asset_frame";
import type { EnvironmentLight } from "./lights";
import { determinant, type Matrix4, multiplied, type Triple, turned } from "./matrix";

const UPRIGHT = 1e-8; // how far the rotated zenith may be from (0, 0, 1), as in numpy.allclose

/** One texel of an environment map: its unit direction in the asset's frame, and its solid angle (sr). */
export interface EnvironmentTexel {
  readonly direction: Triple;
  readonly solidAngle: number;
  readonly row: number;
  readonly column: number;
}

/**
 * Unit direction of every texel in the asset's frame, and its radiance times solid angle (sr). On the hemisphere only what is above the asset's
 * horizon counts; where the map is upright, a row that straddles the horizon is cut there.
 */
export function* environmentSamples(light: EnvironmentLight, domain: "sphere" | "hemisphere", assetFromWorld: Matrix4): Generator<DistantLight> {
  const { width, height, pixels, color } = light;
  for (const { direction, solidAngle, row, column } of environmentTexels(width, height, domain, mapFrame(light, assetFromWorld))) {
    const at = 3 * (row * width + column);
    yield [direction, [pixels[at] * solidAngle * color[0], pixels[at + 1] * solidAngle * color[1], pixels[at + 2] * solidAngle * color[2]]];
  }
}

/** From a map's own frame, in which it is not turned, to the asset's. */
export function mapFrame({ turn = 0 }: EnvironmentLight, assetFromWorld: Matrix4): Matrix4 {
  const [c, s] = [Math.cos(turn), Math.sin(turn)];
  return turn === 0 ? assetFromWorld : multiplied(assetFromWorld, [[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]);
}

/** Whether a rigid motion and uniform scale keeps the zenith. */
export const isUpright = (matrix: Matrix4): boolean => zenithStays(unscaled(matrix));

const unscaled = (matrix: Matrix4): Matrix4 => {
  const scale = Math.cbrt(determinant(matrix));
  return matrix.map((row) => row.map((value) => value / scale));
};

const zenithStays = ([, , up]: Matrix4): boolean => Math.abs(up[0]) <= UPRIGHT && Math.abs(up[1]) <= UPRIGHT && Math.abs(up[2] - 1) <= 1e-5;

/** The texels of a map of this size; `assetFromMap` turns their directions. */
export function* environmentTexels(width: number, height: number, domain: "sphere" | "hemisphere", assetFromMap: Matrix4): Generator<EnvironmentTexel> {
  const rotation = unscaled(assetFromMap);
  const upright = zenithStays(rotation);
  const cut = domain === "hemisphere" && upright;
  const elevation = (row: number) => {
    const angle = Math.PI / 2 - row * (Math.PI / height);
    return cut ? Math.max(angle, 0) : angle;
  };
  for (let row = 0; row < height; ++row) {
    const top = elevation(row);
    const bottom = elevation(row + 1);
    const solidAngle = (Math.sin(top) - Math.sin(bottom)) * ((2 * Math.PI) / width);
    if (solidAngle === 0) continue;
    const center = (top + bottom) / 2;
    for (let column = 0; column < width; ++column) {
      const azimuth = (0.5 - (column + 0.5) / width) * 2 * Math.PI;
      const direction = turned(rotation, [Math.cos(center) * Math.cos(azimuth), Math.cos(center) * Math.sin(azimuth), Math.sin(center)]);
      if (domain === "hemisphere" && !upright && direction[2] <= 0) continue;
      yield { direction, solidAngle, row, column };
    }
  }
}

/** A map whose texels are averaged by solid angle, as far as `rows` are left and both sides can be divided; else the same. */
export function reduced(light: EnvironmentLight, rows: number): EnvironmentLight {
  const { width, height, pixels } = light;
  let factor = Math.floor(height / rows);
  while (factor > 1 && (height % factor || width % factor)) --factor;
  if (factor <= 1) return light;
  const [across, down] = [width / factor, height / factor];
  const out = new Float64Array(3 * across * down);
  const above = (row: number) => Math.cos((row * Math.PI) / height); // the sine of a row's upper edge
  for (let row = 0; row < height; ++row) {
    const block = Math.floor(row / factor);
    const share = (above(row) - above(row + 1)) / (above(factor * block) - above(factor * (block + 1))) / factor;
    for (let column = 0; column < width; ++column) {
      const to = 3 * (block * across + Math.floor(column / factor));
      for (let c = 0; c < 3; ++c) out[to + c] += share * pixels[3 * (row * width + column) + c];
    }
  }
  return { ...light, width: across, height: down, pixels: out };
}
