/** What the jobs of both three.js renderers share: a quad in the receivers' plane, a camera above it, and lights. */
import * as THREE from "three";
import type { Light, Triple } from "../../src";
import { type Job, lightOfJson, mix } from "./job";

interface Followed {
  lights: Light[];
  follow(...lights: THREE.Light[]): unknown;
  setNamedLight(name: string, intensity: number, color: Triple): unknown;
}

/** The rectangle |x| <= half[0], |y| <= half[1] at z = half[2] of the asset's world, row 0 at +y, in three's y-up world. */
export function quad<M extends THREE.Material>(job: Job, material: M): THREE.Mesh<THREE.BufferGeometry, M> {
  const [a, b, z] = job.half as Triple;
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute([-a, z, -b, a, z, -b, -a, z, b, a, z, b], 3));
  geometry.setAttribute("normal", new THREE.Float32BufferAttribute([0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0], 3));
  geometry.setAttribute("uv", new THREE.Float32BufferAttribute([0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5], 2));
  geometry.setAttribute("uv1", new THREE.Float32BufferAttribute([0, 0, 1, 0, 0, 1, 1, 1], 2));
  geometry.setIndex([0, 2, 1, 1, 2, 3]);
  return new THREE.Mesh(geometry, material);
}

export function facingCamera(job: Job): THREE.OrthographicCamera {
  const [a, b] = job.half as Triple;
  const camera = new THREE.OrthographicCamera(-a, a, b, -b, 0.1, 100);
  camera.position.set(0, 50, 0);
  camera.up.set(0, 0, -1);
  camera.lookAt(0, 0, 0);
  return camera;
}

/** `job.lights` as the library's, and `job.follow` as three's own: {type, color, intensity, position, target, angle, penumbra, decay, width, height}, y up. */
export function addLights(job: Job, map: Followed, scene: THREE.Scene): void {
  map.lights.push(...job.lights.map(lightOfJson));
  mix(job, map);
  for (const json of (job.follow as Record<string, unknown>[]) ?? []) {
    const kind = json.type as "SpotLight";
    const light = new THREE[kind]() as THREE.SpotLight;
    light.color.setRGB(...(json.color as [number, number, number]));
    light.intensity = json.intensity as number;
    light.position.set(...(json.position as [number, number, number]));
    if (json.target && light.target) light.target.position.set(...(json.target as [number, number, number]));
    for (const key of ["angle", "penumbra", "decay", "distance", "width", "height"] as const) if (key in json) light[key as "angle"] = json[key] as number;
    if (json.type === "RectAreaLight") light.lookAt(...(json.target as [number, number, number]));
    scene.add(light);
    map.follow(light);
  }
}

/** A scene of `job.blocker`, corners of triangles in the asset's world, and a light whose shadow three draws; `map` follows it. */
export function shadowScene(job: Job, map: Followed, follow: Record<string, unknown>, material: THREE.Material = new THREE.MeshLambertMaterial({ side: THREE.DoubleSide })) {
  const scene = new THREE.Scene();
  const geometry = new THREE.BufferGeometry();
  const corners = (job.blocker as number[][]).flatMap(([x, y, z]) => [x, z, -y]);
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(corners, 3));
  geometry.computeVertexNormals();
  const mesh = new THREE.Mesh(geometry, material);
  mesh.castShadow = mesh.receiveShadow = true;
  scene.add(mesh);
  addLights({ ...job, follow: [follow] }, map, scene);
  const light = scene.children[1] as THREE.PointLight;
  light.castShadow = true;
  light.shadow.mapSize.set(1024, 1024);
  Object.assign(light.shadow.camera, { near: 0.05, far: 30, left: -4, right: 4, top: 4, bottom: -4 });
  light.shadow.camera.updateProjectionMatrix();
  return { scene, light, geometry };
}

/**
 * A pixel, in a row of `job.places`, of each place x, y, z, nx, ny, nz of the asset's world: a quad all of whose corners are there, on a mesh that was moved.
 * `pixel` of a vertex is where it is on the screen.
 */
export function placesMesh<M extends THREE.Material>(job: Job, material: M): THREE.Mesh<THREE.BufferGeometry, M> {
  const places = job.places as number[][];
  const mesh = new THREE.Mesh(new THREE.BufferGeometry(), material);
  mesh.position.set(0.3, -0.2, 0.5);
  mesh.rotation.set(0.1, 0.7, -0.3);
  mesh.updateMatrixWorld(true);
  const local = mesh.matrixWorld.clone().invert();
  const [position, normal, pixel, index] = [[], [], [], []] as number[][];
  places.forEach(([x, y, z, nx, ny, nz], i) => {
    const at = new THREE.Vector3(x, z, -y).applyMatrix4(local);
    const facing = new THREE.Vector3(nx, nz, -ny).transformDirection(local);
    const [left, right] = [i, i + 1].map((edge) => (2 * edge) / places.length - 1);
    for (const corner of [[left, -1], [right, -1], [left, 1], [right, 1]]) {
      position.push(...at.toArray());
      normal.push(...facing.toArray());
      pixel.push(...corner);
    }
    index.push(...[0, 1, 2, 2, 1, 3].map((k) => 4 * i + k));
  });
  mesh.geometry.setAttribute("position", new THREE.Float32BufferAttribute(position, 3));
  mesh.geometry.setAttribute("normal", new THREE.Float32BufferAttribute(normal, 3));
  mesh.geometry.setAttribute("pixel", new THREE.Float32BufferAttribute(pixel, 2));
  mesh.geometry.setIndex(index);
  mesh.frustumCulled = false;
  return mesh;
}
