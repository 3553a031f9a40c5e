/** What passes of a GPU need to compute the weights of lights inside a scene: cells of its surfaces, what casts shadows, and the tables from irradiance to weights. */
import type { LightsInAssetFrame } from "./asset_frame";
import { type LinkedObjects, type Links, isLinked, linksOf } from "./light_linking";
import type { LightValues } from "./light_values";
import { type AreaLight, type DirectionalLight, type PunctualLight, unit } from "./lights";
import { cross, type Triple } from "./matrix";
import { type ProfileLook, profileLook } from "./point_light";
import { type Cells, SIDE } from "./received_light";
import type { EnvironmentDirections } from "./environment_directions";

export interface Surfels {
  readonly cells: Cells;
  /** Corners of the triangles that cast shadows, nine numbers each, meters. */
  readonly corners: Float32Array;
  /** Of which objects surfels and triangles are, where lights may choose. */
  readonly objects?: LinkedObjects;
  /** What the mean irradiance on the cells' patches is multiplied by, (patches, 3), before the tables; undefined: by nothing. */
  readonly reflectance?: Float64Array;
  /** Tables from there to the weights of the light functions, one after the other; of a transfer asset the last one takes weights of shapes. */
  readonly tables: readonly LightValues[];
}

/** The number of the table whose sums are weights of shapes: what objects emit and environments are added there. */
export const shapesTable = ({ tables }: Surfels): number => Math.max(0, tables.length - 2);

/** Cells in the order of their patches, as textures with `width` texels in each row hold them. */
export interface PackedCells {
  readonly width: number;
  readonly height: number;
  /** Place less `middle` (m), area (square meters), RGBA. */
  readonly places: Float32Array;
  /** Unit normal, and the cell's share of its patch's area, RGBA. */
  readonly normals: Float32Array;
  /** Of every patch, its first cell and how many there are, RGBA. */
  readonly ranges: Float32Array;
  readonly rangesWidth: number;
  readonly rangesHeight: number;
  /** Meters, the asset's frame: single precision is finest about the origin. */
  readonly middle: Triple;
  /** Radius (m) about `middle` that holds all cells and all that casts. */
  readonly reach: number;
}

export function packedCells({ cells, corners }: Surfels): PackedCells {
  const { count, patches, owners, places, normals, areas, patchAreas } = cells;
  const order = Array.from({ length: count }, (_, i) => i).sort((a, b) => owners[a] - owners[b] || a - b);
  const [width, height] = square(count);
  const [rangesWidth, rangesHeight] = square(patches);
  const middle = middleOf(places);
  const out = { places: new Float32Array(4 * width * height), normals: new Float32Array(4 * width * height), ranges: new Float32Array(4 * rangesWidth * rangesHeight) };
  order.forEach((cell, i) => {
    const patch = owners[cell];
    for (let k = 0; k < 3; ++k) {
      out.places[4 * i + k] = places[3 * cell + k] - middle[k];
      out.normals[4 * i + k] = normals[3 * cell + k];
    }
    out.places[4 * i + 3] = areas[cell];
    out.normals[4 * i + 3] = areas[cell] / Math.max(patchAreas[patch], 1e-30);
    if (out.ranges[4 * patch + 1]++ === 0) out.ranges[4 * patch] = i;
  });
  return { ...out, width, height, rangesWidth, rangesHeight, middle, reach: Math.max(farthest(places, middle), farthest(corners, middle)) };
}

/** The reflectance of patches as `PackedCells` has its ranges, RGBA: 1 where there is none. */
export function packedReflectance(reflectance: Float64Array | undefined, { rangesWidth, rangesHeight }: PackedCells): Float32Array {
  const out = new Float32Array(4 * rangesWidth * rangesHeight);
  for (let i = 0; i < out.length; ++i) out[i] = i % 4 < 3 ? (reflectance?.[3 * Math.floor(i / 4) + (i % 4)] ?? 1) : 1;
  return out;
}

/** Sides of a texture of `count` texels that is about as high as wide. */
export function square(count: number): [number, number] {
  const width = Math.max(1, Math.ceil(Math.sqrt(count)));
  return [width, Math.max(1, Math.ceil(count / width))];
}

/** One point of a light, or its direction, as a pass adds it. */
export interface Look {
  /** Meters less the cells' middle, or the unit direction to a distant light. */
  readonly place: Triple;
  readonly distant: boolean;
  readonly color: Triple;
  /** Where a spot or a part of an area shines, unit. */
  readonly axis: Triple;
  readonly a0: number;
  readonly radius: number;
  readonly falloff: "linear" | "inverse-square";
  /** Half-angles of a spot, rad. */
  readonly cone?: readonly [number, number];
  /** Whether it shines by the cosine to `axis`, as a part of an area. */
  readonly lambertian: boolean;
  /** What its light's color is multiplied by, of one direction of an environment. */
  readonly factor?: Triple;
  /** A profile about `axis`. */
  readonly shape?: ProfileLook;
  /** What its light chooses of the scene's objects, if it does. */
  readonly links?: Links;
}

export type Placed = PunctualLight | AreaLight | DirectionalLight | EnvironmentDirections;

/** The looks of a light in the asset's frame: one, a grid of points of an area, or directions of an environment. */
export function looksOf(light: Placed, middle: Triple): Look[] {
  const away = (p: Triple): Triple => [p[0] - middle[0], p[1] - middle[1], p[2] - middle[2]];
  const chosen = light.kind !== "environment-directions" && isLinked(light) ? { links: linksOf(light) } : {};
  const plain = { ...chosen, distant: false, axis: [0, 0, 1] as Triple, a0: 1, radius: 1e-4, falloff: "inverse-square", lambertian: false } as const;
  if (light.kind === "directional") return [{ ...plain, distant: true, place: light.direction, color: light.color }];
  if (light.kind === "environment-directions") return light.directions.map(([place, factor]) => ({ ...plain, distant: true, place, color: light.color, factor }));
  if (light.kind === "area") {
    const { position, u, v, a0 } = light;
    const axis = unit(cross(u, v));
    const color = light.color.map((x) => x / SIDE ** 2) as unknown as Triple;
    const steps = Array.from({ length: SIDE }, (_, i) => (i + 0.5) / SIDE - 0.5);
    const points = steps.flatMap((s) => steps.map((t) => [0, 1, 2].map((k) => position[k] + s * u[k] + t * v[k]) as unknown as Triple));
    return points.map((point) => ({ ...plain, place: away(point), color, axis, a0, lambertian: true }));
  }
  const { position, color, a0, radius, falloff } = light;
  const shape = profileLook(light);
  const look = { ...plain, place: away(position), color, a0, radius, falloff, ...(shape ? { shape, axis: light.direction as Triple } : {}) };
  return [light.kind === "spot" ? { ...look, axis: light.direction, cone: [light.inner, light.outer] } : look];
}

/** Lights that lay irradiance on cells. */
export function placed({ punctual, areas, distant, environmentDirections }: LightsInAssetFrame): Placed[] {
  const suns = distant.map(([direction, color, links]) => ({ kind: "directional", direction, color, ...links }) as const);
  return [...punctual, ...areas, ...suns, ...environmentDirections];
}

function middleOf(points: Float64Array): Triple {
  return [0, 1, 2].map((k) => {
    let [least, most] = [Infinity, -Infinity];
    for (let i = k; i < points.length; i += 3) [least, most] = [Math.min(least, points[i]), Math.max(most, points[i])];
    return least < Infinity ? (least + most) / 2 : 0;
  }) as unknown as Triple;
}

function farthest(points: ArrayLike<number>, from: Triple): number {
  let most = 0;
  for (let i = 0; i < points.length; i += 3) most = Math.max(most, Math.hypot(points[i] - from[0], points[i + 1] - from[1], points[i + 2] - from[2]));
  return most;
}
