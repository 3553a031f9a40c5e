/** Gaussians of the geodesic distance, by formula and by table: `srbf/basis/gaussian.py`. */

/** R(cos theta) = exp(-acos(cos theta)^2 / (2 spread^2)), spread in rad [Wong2005, eq. 2]. */
export function gaussian(cosTheta: number, spread: number): number {
  const theta = Math.acos(Math.min(1, Math.max(-1, cosTheta)));
  return Math.exp(-0.5 * (theta / spread) ** 2);
}

/** R from a table of n entries, entry j at cos theta = -1 + 2 j / (n - 1), by fetch and mix [Wong2005, fig. 9]. */
export function lookup(table: Float32Array, cosTheta: number): number {
  const x = (Math.min(1, Math.max(-1, cosTheta)) + 1) * (0.5 * (table.length - 1));
  const j = Math.min(Math.floor(x), table.length - 2);
  const t = x - j;
  return table[j] * (1 - t) + table[j + 1] * t;
}
