/** Blender's z-up world and three's y-up one, camera and scene of a view. */
import { Matrix4, PerspectiveCamera, Vector3 } from "three";
import type { Triple } from "../src";

export const toThree = (p: Triple): Vector3 => new Vector3(p[0], p[2], -p[1]);

export const fromThree = (v: Vector3): Triple => [v.x, -v.z, v.y];

/** viewer.json's camera: rows of `rotation` are right, down, forward; `lens` maps camera coordinates to (u, v, 1) times depth. */
export interface FittedCamera {
  position: Triple;
  rotation: [Triple, Triple, Triple];
  lens: [Triple, Triple, Triple];
}

/** A three.js camera that matches the picture, whose corners are at `scale` and `offset` in clip space. */
export function viewCamera(fitted: FittedCamera, scale: [number, number], offset: [number, number], near: number, far: number): PerspectiveCamera {
  const camera = new PerspectiveCamera();
  const [right, down, forward] = fitted.rotation.map(toThree);
  camera.matrix.makeBasis(right, down.clone().negate(), forward.clone().negate()).setPosition(toThree(fitted.position));
  camera.matrix.decompose(camera.position, camera.quaternion, camera.scale);
  camera.updateMatrixWorld(true);
  const [sx, sy] = scale;
  const [ox, oy] = offset;
  const l = fitted.lens;
  const depth = far - near;
  camera.projectionMatrix = new Matrix4(
    2 * sx * l[0][0], -2 * sx * l[0][1], -2 * sx * l[0][2] - (ox - sx), 0,
    0, 2 * sy * l[1][1], 2 * sy * l[1][2] - (sy + oy), 0,
    0, 0, -(far + near) / depth, (-2 * far * near) / depth,
    0, 0, -1, 0,
  ); // prettier-ignore
  camera.projectionMatrixInverse.copy(camera.projectionMatrix).invert();
  camera.near = near;
  camera.far = far;
  camera.fov = (2 * Math.atan(1 / camera.projectionMatrix.elements[5]) * 180) / Math.PI;
  return camera;
}
