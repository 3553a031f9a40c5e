/** Directions over the disc of a sun that has a size, and the vectors across a direction. */
import type { Triple } from "../src";
import { cross } from "../src/matrix";

// Sixteen points that fill the unit disc evenly and keep its area [Sobol1967], for suns that have a size.
const DISC = [
  [0, 0], [-0.70710678, 0], [0, 0.5], [0, -0.8660254], [0.55901699, -0.55901699], [-0.25, 0.25], [-0.66143783, -0.66143783], [0.4330127, 0.4330127],
  [-0.89454251, 0.37053164], [0.61108887, -0.2531213], [0.31730434, 0.76604044], [-0.16570679, -0.40005157], [-0.51646436, -0.21392654], [0.83277376, 0.34494618],
  [0.09567086, -0.23096988], [-0.28701257, 0.69290965],
] as const; // prettier-ignore

/** Unit directions that fill a sun's disc of angular diameter `angle` (rad). */
export function discDirections(direction: Triple, angle: number): Triple[] {
  if (angle === 0) return [direction];
  const right = across(direction);
  const up = cross(direction, right);
  const t = Math.tan(angle / 2);
  return DISC.map(([x, y]) => unit([0, 1, 2].map((c) => direction[c] + t * (x * right[c] + y * up[c])) as unknown as Triple));
}

/** A unit vector perpendicular to a unit direction. */
export function across(direction: Triple): Triple {
  return unit(cross(direction, Math.abs(direction[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0]));
}

function unit(v: Triple): Triple {
  const length = Math.hypot(...v);
  return [v[0] / length, v[1] / length, v[2] / length];
}
