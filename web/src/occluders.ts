/** Whether something stands between two places, and what is nearest to one: triangles in a hierarchy of boxes, on the CPU. */
import { squaredDistance } from "./nearest_triangle";

const LEAF = 4; // triangles
const DEEPEST = 64;
const BINS = 16;
const TOUCHING = 1e-6; // of the coordinates: a triangle as near as that is the nearest

export class Occluders {
  /** Boxes, six numbers each: least x, y, z, most x, y, z. */
  private readonly boxes: Float64Array;
  /** Of an inner node its second child (the first follows it), of a leaf the first of its triangles; and how many those are, 0 for an inner node. */
  private readonly next: Int32Array;
  private readonly counts: Int32Array;
  /** Of each triangle in the order of the leaves, nine numbers: a corner and the two edges from it. */
  private readonly triangles: Float64Array;
  /** The numbers that these have among `corners`. */
  private readonly order: Uint32Array;
  private readonly stack = new Int32Array(DEEPEST);
  private used = 0;
  /** Which triangle, in the order of the leaves, was last nearest to a place. */
  private former = 0;

  /** `corners`: nine numbers per triangle. */
  constructor(corners: Float32Array) {
    const count = corners.length / 9;
    const nodes = Math.max(1, 2 * count);
    this.boxes = new Float64Array(6 * nodes);
    this.next = new Int32Array(nodes);
    this.counts = new Int32Array(nodes);
    const order = (this.order = Uint32Array.from({ length: count }, (_, i) => i));
    if (count > 0) this.build(new Spread(corners), order, 0, count);
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
    const ix = 1 / dx;
    const iy = 1 / dy;
    const iz = 1 / dz;
    const onX = ix < 0 ? 3 : 0; // the side of a box that the segment meets first
    const onY = iy < 0 ? 4 : 1;
    const onZ = iz < 0 ? 5 : 2;
    let top = 0;
    stack[top++] = 0;
    while (top > 0) {
      const node = stack[--top];
      const b = 6 * node;
      let near = 0;
      let far = 1;
      let side = (boxes[b + onX] - x) * ix;
      if (side > near) near = side;
      side = (boxes[b + 3 - onX] - x) * ix;
      if (side < far) far = side;
      side = (boxes[b + onY] - y) * iy;
      if (side > near) near = side;
      side = (boxes[b + 5 - onY] - y) * iy;
      if (side < far) far = side;
      side = (boxes[b + onZ] - z) * iz;
      if (side > near) near = side;
      side = (boxes[b + 7 - onZ] - z) * iz;
      if (side < far) far = side;
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

  /** The number of the triangle that is nearest to a place, of several any; -1 of none. Fast where places follow each other along a surface. */
  nearest(x: number, y: number, z: number): number {
    if (this.used === 0) return -1;
    const { boxes, next, counts, stack, order, triangles } = this;
    const apart = (node: number): number => {
      const b = 6 * node;
      const dx = Math.max(boxes[b] - x, x - boxes[b + 3], 0);
      const dy = Math.max(boxes[b + 1] - y, y - boxes[b + 4], 0);
      const dz = Math.max(boxes[b + 2] - z, z - boxes[b + 5], 0);
      return dx * dx + dy * dy + dz * dz;
    };
    let found = this.former;
    let least = squaredDistance(triangles, 9 * found, x, y, z);
    if (Number.isNaN(least)) return -1;
    const touching = (TOUCHING * (1 + Math.abs(x) + Math.abs(y) + Math.abs(z))) ** 2;
    let top = 0;
    stack[top++] = 0;
    while (top > 0 && least > touching) {
      const node = stack[--top];
      if (apart(node) >= least) continue;
      if (counts[node] === 0) {
        const nearerFirst = apart(node + 1) < apart(next[node]);
        stack[top++] = nearerFirst ? next[node] : node + 1;
        stack[top++] = nearerFirst ? node + 1 : next[node];
        continue;
      }
      for (let i = next[node]; i < next[node] + counts[node]; ++i) {
        const squared = squaredDistance(triangles, 9 * i, x, y, z);
        if (squared < least) [least, found] = [squared, i];
      }
    }
    this.former = found;
    return order[found];
  }

  /** [Moeller1997], both sides. */
  private meets(at: number, x: number, y: number, z: number, dx: number, dy: number, dz: number): boolean {
    const t = this.triangles;
    const ax = t[at + 3];
    const ay = t[at + 4];
    const az = t[at + 5];
    const bx = t[at + 6];
    const by = t[at + 7];
    const bz = t[at + 8];
    const px = dy * bz - dz * by;
    const py = dz * bx - dx * bz;
    const pz = dx * by - dy * bx;
    const determinant = ax * px + ay * py + az * pz;
    if (determinant === 0) return false;
    const inverse = 1 / determinant;
    const sx = x - t[at];
    const sy = y - t[at + 1];
    const sz = z - t[at + 2];
    const u = (sx * px + sy * py + sz * pz) * inverse;
    if (u < 0 || u > 1) return false;
    const qx = sy * az - sz * ay;
    const qy = sz * ax - sx * az;
    const qz = sx * ay - sy * ax;
    const v = (dx * qx + dy * qy + dz * qz) * inverse;
    if (v < 0 || u + v > 1) return false;
    const along = (bx * qx + by * qy + bz * qz) * inverse;
    return along >= 0 && along <= 1;
  }

  /** Split where the surface area heuristic says [MacDonald1990], at the median where it does not. */
  private build(spread: Spread, order: Uint32Array, first: number, end: number, depth = 0): void {
    const node = this.used++;
    spread.box(order, first, end, this.boxes, 6 * node);
    if (end - first <= LEAF) {
      this.next[node] = first;
      this.counts[node] = end - first;
      return;
    }
    const middle = (depth < DEEPEST / 2 && spread.split(order, first, end)) || spread.median(order, first, end);
    this.build(spread, order, first, middle, depth + 1);
    this.next[node] = this.used;
    this.build(spread, order, middle, end, depth + 1);
  }
}

/** Boxes of triangles, twice their middles, and planes between them. */
class Spread {
  private readonly boxes: Float64Array;
  private readonly middles: Float64Array;
  private readonly counts = new Int32Array(BINS);
  private readonly bins = new Float64Array(6 * BINS);
  private readonly before = new Float64Array(BINS); // of the cost of what lies before each plane
  private readonly range = new Float64Array(6); // of middles
  private readonly sum = new Float64Array(6);

  constructor(corners: Float32Array) {
    const count = corners.length / 9;
    this.boxes = new Float64Array(6 * count);
    this.middles = new Float64Array(3 * count);
    for (let i = 0; i < count; ++i) {
      for (let k = 0; k < 3; ++k) {
        const [a, b, c] = [corners[9 * i + k], corners[9 * i + 3 + k], corners[9 * i + 6 + k]];
        this.boxes[6 * i + k] = Math.min(a, b, c);
        this.boxes[6 * i + 3 + k] = Math.max(a, b, c);
        this.middles[3 * i + k] = this.boxes[6 * i + k] + this.boxes[6 * i + 3 + k];
      }
    }
  }

  /** The box about triangles, written at a place. */
  box(order: Uint32Array, first: number, end: number, out: Float64Array, at: number): void {
    empty(out, at);
    for (let i = first; i < end; ++i) widen(out, at, this.boxes, 6 * order[i]);
  }

  /** Put triangles in front that lie on one side of the best of the planes between bins of each axis; where the others begin, 0 where all middles are one. */
  split(order: Uint32Array, first: number, end: number): number {
    const { middles, boxes, counts, bins, before, range, sum } = this;
    this.measure(order, first, end);
    let cost = Infinity;
    let axis = -1;
    let plane = 0;
    for (let k = 0; k < 3; ++k) {
      const scale = BINS / (range[3 + k] - range[k]);
      if (!(scale < Infinity)) continue;
      counts.fill(0);
      for (let bin = 0; bin < BINS; ++bin) empty(bins, 6 * bin);
      for (let i = first; i < end; ++i) {
        const bin = Math.min(BINS - 1, Math.floor((middles[3 * order[i] + k] - range[k]) * scale));
        ++counts[bin];
        widen(bins, 6 * bin, boxes, 6 * order[i]);
      }
      empty(sum, 0);
      for (let bin = 1, count = 0; bin < BINS; ++bin) {
        widen(sum, 0, bins, 6 * (bin - 1));
        before[bin] = area(sum) * (count += counts[bin - 1]);
      }
      empty(sum, 0);
      for (let bin = BINS - 1, count = 0; bin > 0; --bin) {
        widen(sum, 0, bins, 6 * bin);
        count += counts[bin];
        if (count === 0 || count === end - first) continue;
        const own = before[bin] + area(sum) * count;
        if (own < cost) [cost, axis, plane] = [own, k, bin];
      }
    }
    if (axis < 0) return 0;
    const scale = BINS / (range[3 + axis] - range[axis]);
    const isBefore = (triangle: number) => Math.min(BINS - 1, Math.floor((middles[3 * triangle + axis] - range[axis]) * scale)) < plane;
    let [low, high] = [first, end - 1];
    while (low <= high) {
      if (isBefore(order[low])) ++low;
      else {
        const other = order[high];
        order[high--] = order[low];
        order[low] = other;
      }
    }
    return low;
  }

  /** Sort along the longest side; where the second half begins. */
  median(order: Uint32Array, first: number, end: number): number {
    const { middles, range } = this;
    this.measure(order, first, end);
    const sides = [0, 1, 2].map((k) => range[3 + k] - range[k]);
    const axis = sides.indexOf(Math.max(...sides));
    order.subarray(first, end).sort((a, b) => middles[3 * a + axis] - middles[3 * b + axis]);
    return (first + end) >> 1;
  }

  private measure(order: Uint32Array, first: number, end: number): void {
    const { middles, range } = this;
    empty(range, 0);
    for (let i = first; i < end; ++i) {
      for (let k = 0; k < 3; ++k) {
        const x = middles[3 * order[i] + k];
        if (x < range[k]) range[k] = x;
        if (x > range[3 + k]) range[3 + k] = x;
      }
    }
  }
}

function empty(boxes: Float64Array, at: number): void {
  boxes.fill(Infinity, at, at + 3).fill(-Infinity, at + 3, at + 6);
}

function widen(boxes: Float64Array, at: number, others: Float64Array, other: number): void {
  for (let k = 0; k < 3; ++k) {
    if (others[other + k] < boxes[at + k]) boxes[at + k] = others[other + k];
    if (others[other + 3 + k] > boxes[at + 3 + k]) boxes[at + 3 + k] = others[other + 3 + k];
  }
}

/** Half of the surface of the first box; 0 of an empty one. */
function area(box: Float64Array): number {
  const [x, y, z] = [box[3] - box[0], box[4] - box[1], box[5] - box[2]];
  return x < 0 ? 0 : x * y + y * z + z * x;
}
