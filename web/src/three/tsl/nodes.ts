/**
 * The arithmetic of the shader pack in three.js' node language, which becomes WGSL or GLSL: one function for each of the pack's, by the same name.
 * Nodes are built by method calls, so that no shader text is kept twice.
 */
import * as tsl from "three/tsl";

/** A node, or a value that becomes one: three's own node types lack clamped integers and change with every release. */
export type N = any;

const { Fn, abs, clamp, dot, float, floor, int, ivec2, length, max, min, mix, select, textureLoad, vec2, vec3 } = tsl as Record<string, N>;

/** 1 - a.b of unit vectors, precise where they nearly agree; 1 where a is zero. */
export function versine(a: N, b: N): N {
  const chord = a.sub(b).toVar();
  return select(dot(a, a).greaterThan(0.5), dot(chord, chord).mul(0.5), float(1));
}

/** The unit vector along L, zero stays zero. */
export function lightDirection(lightVector: N): N {
  const dist = length(lightVector).toVar();
  return select(dist.greaterThan(0), lightVector.div(max(dist, 1e-30)), vec3(0));
}

/** R from its table of n x 1 texels by fetch and mix; the place is counted from the middle, where the cosine is 0. */
export function weight(table: N, n: number, cosTheta: N): N {
  const middle = 0.5 * (n - 1);
  const fromMiddle = clamp(cosTheta, -1, 1).mul(middle).toVar();
  const j = clamp(int(fromMiddle.add(middle)), 0, n - 2).toVar();
  const fraction = fromMiddle.sub(float(j).sub(middle));
  return mix(textureLoad(table, ivec2(j, 0)).r, textureLoad(table, ivec2(j.add(1), 0)).r, fraction);
}

/** A direction's place on the octahedral square, in [-1, 1]. */
export function octahedralEncode(direction: N): N {
  const d = direction.div(max(abs(direction.x).add(abs(direction.y)).add(abs(direction.z)), 1e-30)).toVar();
  const side = vec2(select(d.x.lessThan(0), float(-1), float(1)), select(d.y.lessThan(0), float(-1), float(1)));
  return select(d.z.lessThan(0), vec2(abs(d.y).oneMinus(), abs(d.x).oneMinus()).mul(side), d.xy);
}

/**
 * One light function at a place of the octahedral square, by four fetches from its tile of `size` nodes a side, `columns` tiles in a row: a function
 * (index, place) of the shader's own, since it is called five times.
 */
export function octahedralLookup(table: N, size: number, columns: number): (index: N, place: N) => N {
  return Fn(([index, place]: N[]) => lookup(table, size, columns, index, place)).setLayout({
    name: "srbfOctahedralLookup",
    type: "vec3",
    inputs: [
      { name: "index", type: "int" },
      { name: "place", type: "vec2" },
    ],
  });
}

function lookup(table: N, size: number, columns: number, index: N, place: N): N {
  const middle = 0.5 * (size - 1);
  const fromMiddle = place.mul(middle).toVar();
  const node = clamp(ivec2(floor(fromMiddle.add(middle))), ivec2(0, 0), ivec2(size - 2, size - 2)).toVar();
  const fraction = fromMiddle.sub(vec2(node).sub(middle)).toVar();
  const row = int(float(index).add(0.5).div(columns)).toVar();
  const at = ivec2(index.sub(row.mul(columns)).mul(size).add(node.x), row.mul(size).add(node.y)).toVar();
  const fetch = (x: number, y: number) => textureLoad(table, at.add(ivec2(x, y))).rgb;
  return mix(mix(fetch(0, 0), fetch(1, 0), fraction.x), mix(fetch(0, 1), fetch(1, 1), fraction.x), fraction.y);
}

/** vec4 per point light in their uniform array, as `packedPointLights` writes them. */
export const POINT_LIGHT_ROWS = 4;

/** A point light's strength times its color, and the unit direction to it, at a receiver (meters, the asset's frame). */
export function pointLightAt(pointLights: N, pointLight: N, receiver: N): { light: N; direction: N } {
  const row = (i: number) => pointLights.element(pointLight.mul(POINT_LIGHT_ROWS).add(i));
  const [place, low, color, axis] = [0, 1, 2, 3].map(row);
  const lightVector = place.xyz.sub(receiver).add(low.xyz).toVar();
  const direction = lightDirection(lightVector).toVar();
  const inverse = max(length(lightVector), place.w).reciprocal().toVar();
  const attenuation = select(low.w.greaterThan(0.5), inverse.mul(inverse), inverse);
  const t = clamp(axis.w.sub(versine(direction.negate(), axis.xyz)).div(max(axis.w.sub(color.w), 1e-6)), 0, 1).toVar();
  const smooth = t.mul(t).mul(float(3).sub(t.mul(2)));
  return { light: color.xyz.mul(attenuation.mul(smooth)), direction };
}

/** A texel of an image of `width` x `height` at a place with v downwards. */
export function texelAt(uv: N, width: number, height: number): N {
  return ivec2(clamp(floor(uv.x.mul(width)), 0, width - 1), clamp(floor(uv.y.mul(height)), 0, height - 1));
}

export function least(index: N, most: number): N {
  return min(index, int(most));
}
