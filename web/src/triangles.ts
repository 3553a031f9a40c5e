/** The triangles of scene.glb that block light, in the asset's z-up frame: `srbf/io/scene_glb.py`, without a library for glTF. */
import { SrbfError } from "./errors";
import type { Numbered } from "./light_linking";
import { carried, type Matrix4, multiplied, type Triple, Z_UP_FROM_Y_UP } from "./matrix";

const MAGIC = 0x46546c67;
const JSON_CHUNK = 0x4e4f534a;
const TRIANGLES = 4; // glTF's mode of a primitive
const READERS = { 5121: Uint8Array, 5123: Uint16Array, 5125: Uint32Array, 5126: Float32Array } as const;
const COMPONENTS: Record<string, number> = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4 };

interface Node {
  name?: string;
  mesh?: number;
  children?: number[];
  matrix?: number[];
  rotation?: number[];
  scale?: number[];
  translation?: number[];
  extras?: { casts_shadow?: boolean };
}

interface Accessor {
  bufferView: number;
  byteOffset?: number;
  componentType: keyof typeof READERS;
  count: number;
  type: string;
}

interface Document {
  scene?: number;
  scenes: { nodes: number[] }[];
  nodes: Node[];
  meshes: { primitives: { attributes: Record<string, number>; indices?: number; material?: number; mode?: number }[] }[];
  materials?: { extras?: { tint_by_cosine?: number[][] }; extensions?: Record<string, { transmissionFactor?: number }> }[];
  accessors: Accessor[];
  bufferViews: { byteOffset?: number; byteLength: number; byteStride?: number }[];
}

/** Opaque triangles that cast shadows, and the objects of the scene that they are of. */
export interface OccludingTriangles extends Numbered {
  /** Nine numbers each, meters. */
  readonly corners: Float32Array;
}

/** What was found so far: corners, the object of every triangle, and all objects by their names. */
interface Found {
  readonly corners: number[];
  readonly objects: number[];
  readonly numbers: Map<string, number>;
}

/** @throws SrbfError on anything but such a .glb. */
export function readOccluders(data: ArrayBuffer, where: string): OccludingTriangles {
  try {
    const { document, bytes } = parsed(data);
    const found: Found = { corners: [], objects: [], numbers: new Map() };
    for (const root of document.scenes[document.scene ?? 0].nodes) visit(document, bytes, root, Z_UP_FROM_Y_UP, found);
    return { corners: new Float32Array(found.corners), objects: new Int32Array(found.objects), names: [...found.numbers.keys()] };
  } catch (error) {
    throw new SrbfError(`expected triangles as binary glTF 2.0 in ${where}, found ${error instanceof Error ? error.message : String(error)}; bake again`);
  }
}

function parsed(data: ArrayBuffer): { document: Document; bytes: ArrayBuffer } {
  const view = new DataView(data);
  if (data.byteLength < 20 || view.getUint32(0, true) !== MAGIC || view.getUint32(16, true) !== JSON_CHUNK) throw new Error("another kind of file");
  const length = view.getUint32(12, true);
  const document = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 20, length)));
  return { document, bytes: data.slice(Math.min(20 + length + 8, data.byteLength)) };
}

function visit(document: Document, bytes: ArrayBuffer, index: number, parent: Matrix4, found: Found): void {
  const node = document.nodes[index];
  const matrix = multiplied(parent, local(node));
  const own = node.name ?? "";
  if (node.mesh !== undefined && !found.numbers.has(own)) found.numbers.set(own, found.numbers.size);
  if (node.mesh !== undefined && node.extras?.casts_shadow !== false) {
    for (const { attributes, indices, material, mode = TRIANGLES } of document.meshes[node.mesh].primitives) {
      if (mode !== TRIANGLES || transmits(document.materials?.[material ?? -1])) continue;
      const points = values(document, bytes, attributes.POSITION);
      const count = points.length / 3;
      const corners = indices === undefined ? undefined : values(document, bytes, indices);
      for (let at = 0; at < (corners?.length ?? count); ++at) {
        const i = corners?.[at] ?? at;
        if (i >= count) throw new Error("a corner that does not exist");
        found.corners.push(...carried(matrix, [points[3 * i], points[3 * i + 1], points[3 * i + 2]] as Triple));
        if (at % 3 === 2) found.objects.push(found.numbers.get(own) as number);
      }
    }
  }
  for (const child of node.children ?? []) visit(document, bytes, child, matrix, found);
}

function transmits(material: NonNullable<Document["materials"]>[number] | undefined): boolean {
  const curve = material?.extras?.tint_by_cosine;
  return curve ? curve.some((row) => row.some((x) => x > 0)) : (material?.extensions?.KHR_materials_transmission?.transmissionFactor ?? 0) > 0;
}

function values(document: Document, bytes: ArrayBuffer, index: number): ArrayLike<number> {
  const { bufferView, byteOffset = 0, componentType, count, type } = document.accessors[index];
  const view = document.bufferViews[bufferView];
  const Reader = READERS[componentType];
  if (!Reader) throw new Error(`numbers of type ${componentType}`);
  const width = COMPONENTS[type];
  const stride = view.byteStride ?? width * Reader.BYTES_PER_ELEMENT;
  const start = (view.byteOffset ?? 0) + byteOffset;
  if (stride === width * Reader.BYTES_PER_ELEMENT) return new Reader(bytes.slice(start, start + count * stride));
  const out = new Float64Array(count * width);
  for (let i = 0; i < count; ++i) {
    const row = new Reader(bytes.slice(start + i * stride, start + i * stride + width * Reader.BYTES_PER_ELEMENT));
    for (let c = 0; c < width; ++c) out[i * width + c] = row[c];
  }
  return out;
}

function local(node: Node): Matrix4 {
  if (node.matrix) {
    const m = node.matrix;
    return [0, 1, 2, 3].map((row) => [0, 1, 2, 3].map((column) => m[4 * column + row]));
  }
  const [x, y, z, w] = node.rotation ?? [0, 0, 0, 1];
  const [a, b, c] = node.scale ?? [1, 1, 1];
  const [tx, ty, tz] = node.translation ?? [0, 0, 0];
  return [
    [a * (1 - 2 * (y * y + z * z)), b * 2 * (x * y - w * z), c * 2 * (x * z + w * y), tx],
    [a * 2 * (x * y + w * z), b * (1 - 2 * (x * x + z * z)), c * 2 * (y * z - w * x), ty],
    [a * 2 * (x * z - w * y), b * 2 * (y * z + w * x), c * (1 - 2 * (x * x + y * y)), tz],
    [0, 0, 0, 1],
  ];
}
