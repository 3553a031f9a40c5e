/** three.js matrices as rows and back. */
import { Matrix4 as ThreeMatrix4 } from "three";
import type { Matrix4 } from "../matrix";

export function rowsOf(matrix: ThreeMatrix4): Matrix4 {
  const e = matrix.elements;
  return [0, 1, 2, 3].map((row) => [e[row], e[row + 4], e[row + 8], e[row + 12]]);
}

export function threeMatrix(rows: Matrix4): ThreeMatrix4 {
  const [a, b, c, d] = rows;
  return new ThreeMatrix4(a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3], c[0], c[1], c[2], c[3], d[0], d[1], d[2], d[3]);
}
