/** Textures of a pool's surfels, and of what they light. */
import type { DataTexture } from "three";
import { ACROSS } from "../gather";
import type { Triple } from "../matrix";
import type { NearPool } from "../near_sources";
import type { PackedCells } from "../surfels";
import { floatTexture } from "./float_textures";

/** Colors (S, 3) of surfels, as the pool's cells lie in their textures: each is its own patch. */
export function colorTexture(values: Float32Array, { width, height }: PackedCells): DataTexture {
  const texels = new Float32Array(4 * width * height);
  for (let i = 0; i < values.length; ++i) texels[4 * Math.floor(i / 3) + (i % 3)] = values[i];
  return floatTexture(texels, width, height);
}

/** Places of a view's clusters, less `middle`, and their normals: ACROSS next to each other. */
export function clusterTextures({ places, normals, clusters }: NearPool, middle: Triple): [places: DataTexture, normals: DataTexture] {
  const rows = Math.ceil(clusters / ACROSS);
  const packed = (values: Float64Array, from: Triple) => {
    const texels = new Float32Array(4 * ACROSS * rows);
    for (let i = 0; i < 3 * clusters; ++i) texels[4 * Math.floor(i / 3) + (i % 3)] = values[i] - from[i % 3];
    return floatTexture(texels, ACROSS, rows);
  };
  return [packed(places, middle), packed(normals, [0, 0, 0])];
}
