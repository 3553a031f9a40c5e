/** What casts shadows on an indirect asset's receivers: the triangles of scene.glb in the asset's frame, opaque ones and translucent walls. */
import { BufferAttribute, BufferGeometry, Color, type Material, type Mesh, type Object3D, Vector3, Vector4 } from "three";
import type { Triple } from "../src";
import { fromThree } from "./frames";

const KNOTS = 8; // of a transmittance by cosine

/** Triangles with attributes `corner` and `cornerNormal`; `curve` of a translucent one, its transmittance at eight cosines. */
export interface Caster {
  geometry: BufferGeometry;
  /** Of its object in the scene; what has none shadows every light. */
  name?: string;
  curve?: Vector4[];
}

/** Corners are relative to `center`. */
export function shadowCasters(scene: Object3D, center: Triple): Caster[] {
  scene.updateMatrixWorld(true);
  const found: Caster[] = [];
  scene.traverse((object) => {
    const mesh = object as Mesh<BufferGeometry, Material>;
    if (mesh.isMesh && casts(mesh)) found.push({ geometry: geometryOf(mesh, center), name: objectName(mesh), curve: transmittanceOf(mesh.material) });
  });
  return found;
}

/** The name of an object as the file has it: three changes names of nodes. */
export function objectName(object: Object3D): string {
  for (let at: Object3D | null = object; at; at = at.parent) if (typeof at.userData.name === "string") return at.userData.name;
  return "";
}

/** In the asset's frame, z up. */
export function geometryOf(mesh: Mesh, center: Triple): BufferGeometry {
  const source = mesh.geometry;
  const position = source.getAttribute("position");
  const normal = source.getAttribute("normal");
  const corner = new Float32Array(3 * position.count);
  const cornerNormal = new Float32Array(3 * position.count);
  const normalMatrix = mesh.matrixWorld.clone().invert().transpose();
  const place = new Vector3();
  for (let i = 0; i < position.count; ++i) {
    const p = fromThree(place.fromBufferAttribute(position, i).applyMatrix4(mesh.matrixWorld));
    corner.set([p[0] - center[0], p[1] - center[1], p[2] - center[2]], 3 * i);
    if (normal) cornerNormal.set(fromThree(place.fromBufferAttribute(normal, i).transformDirection(normalMatrix)), 3 * i);
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("corner", new BufferAttribute(corner, 3));
  geometry.setAttribute("cornerNormal", new BufferAttribute(cornerNormal, 3));
  geometry.setIndex(source.getIndex());
  if (!source.getIndex()) geometry.setDrawRange(0, position.count);
  return geometry;
}

function casts(object: Object3D): boolean {
  for (let at: Object3D | null = object; at; at = at.parent) if (at.userData.casts_shadow === false) return false;
  return true;
}

/** Transmittance of one wall at eight cosines; undefined where it is opaque. */
function transmittanceOf(material: Material): Vector4[] | undefined {
  const curve = material.userData.tint_by_cosine as number[][] | undefined;
  if (curve) return curve.some((row) => row.some((x) => x > 0)) ? curve.map(([r, g, b]) => new Vector4(r, g, b, 0)) : undefined;
  const { transmission = 0, color } = material as Material & { transmission?: number; color?: Color };
  if (!(transmission > 0)) return undefined;
  const { r, g, b } = color ?? new Color(1, 1, 1);
  return Array.from({ length: KNOTS }, () => new Vector4(transmission * r, transmission * g, transmission * b, 0));
}
