/** Tables of an asset, row after row over as many texels as needed, in three.js' node language. */
import type { DataTexture, Texture } from "three";
import * as tsl from "three/tsl";
import type { LightValues } from "../../light_values";
import type { N } from "./nodes";

const { ivec2, textureLoad, vec3 } = tsl as Record<string, N>;

/** What a table is multiplied by, row after row. */
export interface Numbers {
  texture: Texture;
  width: number;
}

/** The texel of index `index` in rows of `width`. */
export const folded = (index: N, width: number): N => ivec2(index.mod(width), index.div(width));

/** An entry of the table times the number of its column. */
export function entryProduct({ count, gray }: LightValues, table: DataTexture, numbers: Numbers, row: N, column: N): N {
  const entry = textureLoad(table, folded(row.mul(count).add(column), (table.image as { width: number }).width));
  return (gray ? vec3(entry.r) : entry.rgb).mul(textureLoad(numbers.texture, folded(column, numbers.width)).rgb);
}
