/** An environment map as few distant lights, for surfaces inside a scene: `srbf.visibility.received.ReceivedLight`. */
import type { DistantLight } from "./asset_frame";
import { environmentTexels, mapFrame } from "./environment";
import type { EnvironmentLight } from "./lights";
import type { Matrix4, Triple } from "./matrix";

const [ROWS, COLUMNS] = [16, 32]; // of blocks of a map

/** An environment in the asset's frame: what shines from each direction, and the color that multiplies all of it. */
export interface EnvironmentDirections {
  readonly kind: "environment-directions";
  readonly color: Triple;
  readonly directions: readonly DistantLight[];
}

const known = new WeakMap<object, Map<string, readonly DistantLight[]>>(); // by the map's pixels and the frame: a map of millions is summed once

export function environmentDirections(light: EnvironmentLight, assetFromWorld: Matrix4): EnvironmentDirections {
  const { pixels, width, height, color } = light;
  const frame = mapFrame(light, assetFromWorld);
  const own = known.get(pixels as object) ?? new Map<string, readonly DistantLight[]>();
  known.set(pixels as object, own);
  const key = JSON.stringify([width, height, frame]);
  const directions = own.get(key) ?? blocksOf({ pixels, width, height }, frame);
  own.set(key, directions);
  return { kind: "environment-directions", color, directions };
}

/** The middle of each block of a map, and what shines from all of it. */
function blocksOf({ pixels, width, height }: Pick<EnvironmentLight, "pixels" | "width" | "height">, assetFromMap: Matrix4): DistantLight[] {
  const [rows, columns] = [Math.ceil(height / ROWS), Math.ceil(width / COLUMNS)];
  const across = Math.ceil(width / columns);
  const sums = new Float64Array(6 * across * Math.ceil(height / rows)); // direction, color
  for (const { direction, solidAngle, row, column } of environmentTexels(width, height, "sphere", assetFromMap)) {
    const at = 6 * (Math.floor(row / rows) * across + Math.floor(column / columns));
    const texel = 3 * (row * width + column);
    for (let k = 0; k < 3; ++k) {
      sums[at + k] += solidAngle * direction[k];
      sums[at + 3 + k] += solidAngle * pixels[texel + k];
    }
  }
  const out: DistantLight[] = [];
  for (let at = 0; at < sums.length; at += 6) {
    const [x, y, z, r, g, b] = sums.subarray(at, at + 6);
    const length = Math.hypot(x, y, z);
    if (length > 0 && (r !== 0 || g !== 0 || b !== 0)) out.push([[x / length, y / length, z / length], [r, g, b]]);
  }
  return out;
}
