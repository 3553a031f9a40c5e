/** 4 x 4 matrices as four rows, as in manifests; translations in meters. */
export type Triple = readonly [number, number, number];
export type Matrix4 = readonly (readonly number[])[];

export const IDENTITY: Matrix4 = [
  [1, 0, 0, 0],
  [0, 1, 0, 0],
  [0, 0, 1, 0],
  [0, 0, 0, 1],
];

/** Blender's z-up world from the y-up world of three.js, Babylon.js (right-handed) and PlayCanvas: (x, y, z) to (x, -z, y), as in glTF exports. */
export const Z_UP_FROM_Y_UP: Matrix4 = [
  [1, 0, 0, 0],
  [0, 0, -1, 0],
  [0, 1, 0, 0],
  [0, 0, 0, 1],
];

export function multiplied(a: Matrix4, b: Matrix4): Matrix4 {
  return a.map((row) => [0, 1, 2, 3].map((column) => row.reduce((sum, value, i) => sum + value * b[i][column], 0)));
}

/** The 3 x 3 part times a vector. */
export function turned(matrix: Matrix4, v: Triple): Triple {
  const row = (i: number) => matrix[i][0] * v[0] + matrix[i][1] * v[1] + matrix[i][2] * v[2];
  return [row(0), row(1), row(2)];
}

/** A point transformed by the whole matrix. */
export function carried(matrix: Matrix4, p: Triple): Triple {
  const [x, y, z] = turned(matrix, p);
  return [x + matrix[0][3], y + matrix[1][3], z + matrix[2][3]];
}

/** Determinant of the 3 x 3 part. */
export function determinant(m: Matrix4): number {
  return (
    m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
    m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
    m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
  );
}

/** The 16 numbers column by column, as GLSL uniforms and most engines take them. */
export function columnMajor(matrix: Matrix4): number[] {
  return [0, 1, 2, 3].flatMap((column) => matrix.map((row) => row[column]));
}

export function cross(a: Triple, b: Triple): Triple {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

export function dot(a: Triple, b: Triple): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
