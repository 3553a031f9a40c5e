/** What a look of a light lays on each cell, in three.js' node language: `surfel_irradiance.glsl`, with shadows of the asset's own triangles. */
import { type Texture, Vector3 } from "three";
import * as tsl from "three/tsl";
import { each } from "./inputs";
import { type N, versine } from "./nodes";

const { abs, clamp, dot, float, Fn, If, int, ivec2, length, max, mix, select, sqrt, textureLoad, uniform, vec2, vec3, vec4, screenCoordinate } = tsl as Record<string, N>;

const NEAR = 8; // sides of a cell, closer than which it is measured by PARTS x PARTS points
const PARTS = 4;
const TILT = 0.25; // of the nearness of a cell: how much the depth of its plane may vary within one texel of a shadow map
const SLACK = 1e-4;

/** Uniforms of a look, and of its shadow map. */
export function lookUniforms() {
  const vector = () => uniform(new Vector3());
  return {
    light: vector(),
    color: vector(),
    axis: vector(),
    a0: uniform(1),
    radius: uniform(1),
    inverseSquare: uniform(1),
    versineInner: uniform(3),
    versineOuter: uniform(4),
    lambertian: uniform(0),
    reach: uniform(1),
    across: vector(),
    up: vector(),
  } as Record<string, N>;
}

export interface CellTextures {
  places: Texture;
  normals: Texture;
  lift: number;
}

/** Six faces about a place, or one map of a direction, `size` texels per side. */
export interface OwnMaps {
  maps: readonly Texture[];
  size: number;
}

/** A node of how much of a light a lifted cell sees. */
export type Visibility = (place: N, normal: N) => N;

/** RGBA of the pass: what `former` holds, and the look's irradiance. */
export function irradianceNode(u: Record<string, N>, cells: CellTextures, former: Texture, distant: boolean, visibility: Visibility): N {
  return Fn(() => {
    const at = ivec2(screenCoordinate).toVar();
    const cell = textureLoad(cells.places, at).toVar();
    const normal = textureLoad(cells.normals, at).xyz.toVar();
    const amount = (distant ? max(dot(normal, u.light), 0) : fromPlace(u, cell, normal)).toVar();
    If(amount.greaterThan(0), () => {
      const place = cell.xyz.add(normal.mul(cells.lift)).toVar();
      amount.mulAssign(visibility(place, normal));
    });
    return vec4(textureLoad(former, at).rgb.add(u.color.mul(amount)), 1);
  })();
}

function fromPlace(u: Record<string, N>, cell: N, normal: N): N {
  const toward = u.light.sub(cell.xyz).toVar();
  const least = cell.w.div(2 * Math.PI).toVar();
  const amount = falling(u, toward, normal, least).toVar();
  If(dot(toward, toward).lessThan(cell.w.mul(NEAR ** 2)), () => {
    amount.assign(0);
    const side = select(normal.z.greaterThanEqual(0), float(1), float(-1)).toVar(); // the frame of [Duff2017]
    const a = float(-1).div(side.add(normal.z)).toVar();
    const b = normal.x.mul(normal.y).mul(a).toVar();
    const tangent = vec3(side.mul(normal.x).mul(normal.x).mul(a).add(1), side.mul(b), side.mul(normal.x).negate()).toVar();
    const bitangent = vec3(b, normal.y.mul(normal.y).mul(a).add(side), normal.y.negate()).toVar();
    each(PARTS, "s", (s) =>
      each(PARTS, "t", (t) => {
        const place = (i: N) => float(i).add(0.5).div(PARTS).sub(0.5).mul(sqrt(cell.w));
        const part = toward.sub(tangent.mul(place(s))).sub(bitangent.mul(place(t))).toVar();
        amount.addAssign(falling(u, part, normal, least.div(PARTS ** 2)).div(PARTS ** 2));
      }),
    );
  });
  return amount;
}

function falling(u: Record<string, N>, toward: N, normal: N, least: N): N {
  const distance = length(toward).toVar();
  const direction = toward.div(max(distance, 1e-15)).toVar();
  const cosine = max(dot(direction, normal), 0);
  const away = direction.negate().toVar();
  const t = clamp(u.versineOuter.sub(versine(away, u.axis)).div(max(u.versineOuter.sub(u.versineInner), 1e-6)), 0, 1).toVar();
  const cone = t.mul(t).mul(float(3).sub(t.mul(2)));
  const ratio = u.a0.div(max(distance, max(u.radius, sqrt(least)))).toVar();
  const shining = mix(float(1), max(dot(away, u.axis), 0), u.lambertian);
  return cosine.mul(cone).mul(shining).mul(mix(ratio, ratio.mul(ratio), u.inverseSquare));
}

/** The texel that a place of a square from -1 to 1 lies in, rows from the top, and the place of its middle. */
function texelOf(place: N, size: number): { texel: N; middle: N } {
  const texel = clamp(ivec2(vec2(place.x, place.y.negate()).mul(0.5).add(0.5).mul(size)), ivec2(0, 0), ivec2(size - 1, size - 1)).toVar();
  const middle = vec2(texel).add(0.5).div(size).mul(2).sub(1).toVar();
  return { texel, middle: vec2(middle.x, middle.y.negate()).toVar() };
}

/** The nearest surface at the texel that a lifted cell falls on, against the cell's plane at the texel's middle. */
export const seenFromPlace = (u: Record<string, N>, { maps, size }: OwnMaps): Visibility => (place, normal) => {
  const away = place.sub(u.light).toVar();
  const most = abs(away).toVar();
  const k = select(most.x.greaterThanEqual(most.y).and(most.x.greaterThanEqual(most.z)), int(0), select(most.y.greaterThanEqual(most.z), int(1), int(2))).toVar();
  const turned = (v: N) => select(k.equal(0), v.yzx, select(k.equal(1), v.zxy, v));
  const own = turned(away).toVar();
  const side = select(own.z.greaterThanEqual(0), float(1), float(-1)).toVar();
  const depth = abs(own.z).toVar();
  const { texel, middle } = texelOf(own.xy.div(depth), size);
  const plane = dot(turned(normal), vec3(middle, side)).div(dot(normal, away));
  const limited = clamp(plane, float(1 - TILT).div(depth), float(1 + TILT).div(depth));
  const face = k.mul(2).add(select(side.lessThan(0), int(1), int(0))).toVar();
  const nearness = float(0).toVar();
  maps.forEach((map, i) => {
    If(face.equal(i), () => {
      nearness.assign(textureLoad(map, texel).r);
    });
  });
  return select(nearness.greaterThan(limited.mul(1 + SLACK)), float(0), float(1));
};

export const seenFromFar = (u: Record<string, N>, { maps, size }: OwnMaps): Visibility => (place, normal) => {
  const { texel, middle } = texelOf(vec2(dot(place, u.across), dot(place, u.up)).div(u.reach), size);
  const slope = vec2(dot(normal, u.across), dot(normal, u.up));
  const plane = dot(normal, place).sub(dot(slope, middle.mul(u.reach))).div(dot(normal, u.light));
  const own = dot(place, u.light).toVar();
  const limited = clamp(plane, own.sub(TILT), own.add(TILT));
  return select(textureLoad(maps[0], texel).r.greaterThan(limited.add(u.reach.mul(2))), float(0), float(1));
};
