/** Whether something stands between two places: rays against triangles in a hierarchy of boxes, on the CPU. */

const LEAF = 4; // triangles
const DEEPEST = 64;

export class Occluders {
  /** Boxes, six numbers each: least x, y, z, most x, y, z. */
  private readonly boxes: Float64Array;
  /** Of an inner node its second child (the first follows it), of a leaf the first of its triangles; and how many those are, 0 for an inner node. */
  private readonly next: Int32Array;
  private readonly counts: Int32Array;
  /** Of each triangle in the order of the leaves, nine numbers: a corner and the two edges from it. */
  private readonly triangles: Float64Array;
  private readonly stack = new Int32Array(DEEPEST);
  private used = 0;

  /** `corners`: nine numbers per triangle. */
  constructor(corners: Float32Array) {
    const count = corners.length / 9;
    const nodes = Math.max(1, 2 * count);
    this.boxes = new Float64Array(6 * nodes);
    this.next = new Int32Array(nodes);
    this.counts = new Int32Array(nodes);
    const order = Uint32Array.from({ length: count }, (_, i) => i);
    const middles = new Float64Array(3 * count);
    for (let i = 0; i < count; ++i) for (let k = 0; k < 3; ++k) middles[3 * i + k] = corners[9 * i + k] + corners[9 * i + 3 + k] + corners[9 * i + 6 + k];
    if (count > 0) this.build(corners, middles, order, 0, count);
    this.triangles = new Float64Array(9 * count);
    order.forEach((from, to) => {
      for (let k = 0; k < 3; ++k) {
        const a = corners[9 * from + k];
        this.triangles[9 * to + k] = a;
        this.triangles[9 * to + 3 + k] = corners[9 * from + 3 + k] - a;
        this.triangles[9 * to + 6 + k] = corners[9 * from + 6 + k] - a;
      }
    });
  }

  /** Whether a triangle meets the segment from (x, y, z) to (x, y, z) + d. */
  between(x: number, y: number, z: number, dx: number, dy: number, dz: number): boolean {
    if (this.used === 0) return false;
    const { boxes, next, counts, stack } = this;
    const [ix, iy, iz] = [1 / dx, 1 / dy, 1 / dz];
    let top = 0;
    stack[top++] = 0;
    while (top > 0) {
      const node = stack[--top];
      const b = 6 * node;
      let near = 0;
      let far = 1;
      let low = (boxes[b] - x) * ix;
      let high = (boxes[b + 3] - x) * ix;
      if (low > high) [low, high] = [high, low];
      if (low > near) near = low;
      if (high < far) far = high;
      low = (boxes[b + 1] - y) * iy;
      high = (boxes[b + 4] - y) * iy;
      if (low > high) [low, high] = [high, low];
      if (low > near) near = low;
      if (high < far) far = high;
      low = (boxes[b + 2] - z) * iz;
      high = (boxes[b + 5] - z) * iz;
      if (low > high) [low, high] = [high, low];
      if (low > near) near = low;
      if (high < far) far = high;
      if (near > far) continue; // NaN, of a ray in the plane of a side, compares false: the box counts as met
      if (counts[node] === 0) {
        stack[top++] = next[node];
        stack[top++] = node + 1;
        continue;
      }
      for (let i = next[node]; i < next[node] + counts[node]; ++i) if (this.meets(9 * i, x, y, z, dx, dy, dz)) return true;
    }
    return false;
  }

  /** [Moeller1997], both sides. */
  private meets(at: number, x: number, y: number, z: number, dx: number, dy: number, dz: number): boolean {
    const t = this.triangles;
    const [e1x, e1y, e1z, e2x, e2y, e2z] = [t[at + 3], t[at + 4], t[at + 5], t[at + 6], t[at + 7], t[at + 8]];
    const [px, py, pz] = [dy * e2z - dz * e2y, dz * e2x - dx * e2z, dx * e2y - dy * e2x];
    const determinant = e1x * px + e1y * py + e1z * pz;
    if (determinant === 0) return false;
    const inverse = 1 / determinant;
    const [sx, sy, sz] = [x - t[at], y - t[at + 1], z - t[at + 2]];
    const u = (sx * px + sy * py + sz * pz) * inverse;
    if (u < 0 || u > 1) return false;
    const [qx, qy, qz] = [sy * e1z - sz * e1y, sz * e1x - sx * e1z, sx * e1y - sy * e1x];
    const v = (dx * qx + dy * qy + dz * qz) * inverse;
    if (v < 0 || u + v > 1) return false;
    const along = (e2x * qx + e2y * qy + e2z * qz) * inverse;
    return along >= 0 && along <= 1;
  }

  /** Split at the median of the longest side of the box about the middles. */
  private build(corners: Float32Array, middles: Float64Array, order: Uint32Array, first: number, end: number): void {
    const node = this.used++;
    const box = 6 * node;
    const within = [Infinity, Infinity, Infinity, -Infinity, -Infinity, -Infinity];
    this.boxes.set(within, box);
    for (let i = first; i < end; ++i) {
      for (let k = 0; k < 3; ++k) {
        const at = 9 * order[i] + k;
        this.boxes[box + k] = Math.min(this.boxes[box + k], corners[at], corners[at + 3], corners[at + 6]);
        this.boxes[box + 3 + k] = Math.max(this.boxes[box + 3 + k], corners[at], corners[at + 3], corners[at + 6]);
        within[k] = Math.min(within[k], middles[3 * order[i] + k]);
        within[3 + k] = Math.max(within[3 + k], middles[3 * order[i] + k]);
      }
    }
    const sides = [0, 1, 2].map((k) => within[3 + k] - within[k]);
    const axis = sides.indexOf(Math.max(...sides));
    if (end - first <= LEAF) {
      this.next[node] = first;
      this.counts[node] = end - first;
      return;
    }
    order.subarray(first, end).sort((a, b) => middles[3 * a + axis] - middles[3 * b + axis]);
    const middle = (first + end) >> 1;
    this.build(corners, middles, order, first, middle);
    this.next[node] = this.used;
    this.build(corners, middles, order, middle, end);
  }
}
