/** Profiles of lights: what share of a light's strength goes into each direction. The arithmetic of `srbf/light_profile.py`. */
import { SrbfError } from "./errors";
import type { FloatImage } from "./image";
import { cross, dot, type Triple } from "./matrix";

const VERTICAL = 1e-6; // sine of the angle to the world's z, up to which a direction is straight up or down
let made = 0;

/**
 * A table of factors on a light's color over directions in the light's own frame, looked up bilinearly. By angles: rows from the light's direction, 0,
 * to the opposite, pi, both included; columns by the azimuth atan2(x, y) + pi, from 0 to 2 pi, both included, or one for all. Projected: an image, row 0
 * at the top, over the square about a spot's cone.
 */
export class Profile {
  /** Whether red, green and blue are equal everywhere. */
  readonly gray: boolean;
  private readonly key = ++made;

  /** @throws SrbfError on a table without two rows, or with numbers that are negative or not finite. */
  constructor(
    readonly table: FloatImage,
    readonly projected = false,
  ) {
    const { width, height, channels, data } = table;
    if (!projected && height < 2) throw new SrbfError(`expected a profile's table of at least 2 rows, found ${height}`);
    if (!data.every((x) => x >= 0 && x < Infinity)) throw new SrbfError("expected a profile of finite factors of at least 0, found others");
    const at = (i: number, c: number) => data[channels * i + c];
    this.gray = channels === 1 || Array.from({ length: width * height }, (_, i) => at(i, 0) === at(i, 1) && at(i, 0) === at(i, 2)).every(Boolean);
  }

  /** The factor of color `c` in a direction of any length, whose components are along x, y and the light's direction; `tangent` of a spot's outer half-angle. */
  at(x: number, y: number, ahead: number, tangent: number, c: number): number {
    const { width, height } = this.table;
    if (this.projected) {
      if (!(ahead > 0)) return 0;
      const scale = 0.5 / (ahead * tangent);
      return this.mixed(clamp((0.5 - y * scale) * height - 0.5, height - 1), clamp((0.5 + x * scale) * width - 0.5, width - 1), c);
    }
    return this.mixed((Math.atan2(Math.hypot(x, y), ahead) / Math.PI) * (height - 1), (Math.atan2(x, y) / (2 * Math.PI) + 0.5) * (width - 1), c);
  }

  /** RGBA, as textures hold it. */
  texels(): Float32Array {
    const { width, height, channels, data } = this.table;
    return Float32Array.from({ length: 4 * width * height }, (_, i) => (i % 4 === 3 ? 1 : data[channels * Math.floor(i / 4) + (channels === 1 ? 0 : i % 4)]));
  }

  /** Which one it is, so that lights can be compared as text. */
  toJSON(): number {
    return this.key;
  }

  private mixed(row: number, column: number, c: number): number {
    const { width, height, channels, data } = this.table;
    const [top, left] = [Math.min(Math.floor(row), height - 1), Math.min(Math.floor(column), width - 1)];
    const [bottom, right] = [Math.min(top + 1, height - 1), Math.min(left + 1, width - 1)];
    const at = (y: number, x: number) => data[channels * (y * width + x) + (channels === 1 ? 0 : c)];
    const across = (y: number) => at(y, left) + (column - left) * (at(y, right) - at(y, left));
    return across(top) + (row - top) * (across(bottom) - across(top));
  }
}

/** Unit vectors x to the right and y upward of what looks along a unit `direction`; `roll` (rad) turns x toward y. */
export function profileAxes(direction: Triple, roll: number): readonly [across: Triple, up: Triple] {
  const back = direction.map((k) => -k) as unknown as Triple;
  const vertical = Math.hypot(direction[0], direction[1]) < VERTICAL;
  const level = cross(vertical ? [0, 1, 0] : [0, 0, 1], back);
  const length = Math.hypot(...level);
  const x = level.map((k) => k / length) as unknown as Triple;
  const y = cross(back, x);
  const [c, s] = [Math.cos(roll), Math.sin(roll)];
  return [x.map((k, i) => c * k + s * y[i]) as unknown as Triple, y.map((k, i) => c * k - s * x[i]) as unknown as Triple];
}

/** The roll (rad) at which `profileAxes` has this x. */
export function rollOf(direction: Triple, x: Triple): number {
  const [level, upward] = profileAxes(direction, 0);
  return Math.atan2(dot(x, upward), dot(x, level));
}

const clamp = (x: number, most: number) => Math.min(most, Math.max(0, x));
