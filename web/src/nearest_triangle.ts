/** How far a place is from a triangle. */

/** The square of that distance from (x, y, z). `triangles`: nine numbers each, a corner and the two edges from it; `at`: the first of them. */
export function squaredDistance(triangles: Float64Array, at: number, x: number, y: number, z: number): number {
  const [px, py, pz] = [x - triangles[at], y - triangles[at + 1], z - triangles[at + 2]];
  const [ax, ay, az] = [triangles[at + 3], triangles[at + 4], triangles[at + 5]];
  const [bx, by, bz] = [triangles[at + 6], triangles[at + 7], triangles[at + 8]];
  const [aa, ab, bb] = [ax * ax + ay * ay + az * az, ax * bx + ay * by + az * bz, bx * bx + by * by + bz * bz];
  const [pa, pb] = [px * ax + py * ay + pz * az, px * bx + py * by + pz * bz];
  const away = (s: number, t: number): number => (px - s * ax - t * bx) ** 2 + (py - s * ay - t * by) ** 2 + (pz - s * az - t * bz) ** 2;
  const determinant = aa * bb - ab * ab;
  if (determinant > 0) {
    const [s, t] = [(bb * pa - ab * pb) / determinant, (aa * pb - ab * pa) / determinant];
    if (s >= 0 && t >= 0 && s + t <= 1) return away(s, t);
  }
  const unit = (share: number, of: number): number => (of > 0 ? Math.min(1, Math.max(0, share / of)) : 0);
  const along = unit(pb - pa - ab + aa, aa - 2 * ab + bb); // from the end of the first edge to that of the second
  return Math.min(away(unit(pa, aa), 0), away(0, unit(pb, bb)), away(1 - along, along));
}
