/** What a look of a light lays on each cell, in three.js' node language: `surfel_irradiance.glsl`, with shadows of the asset's own triangles. */
import { type Texture, Vector3 } from "three";
import * as tsl from "three/tsl";
import { each } from "./inputs";
import { type N, versine } from "./nodes";

const { abs, atan, clamp, dot, float, floor, Fn, If, int, ivec2, length, max, min, mix, select, sqrt, textureLoad, textureSize, uniform, vec2, vec3, vec4, screenCoordinate } = tsl as Record<string, N>;

const NEAR = 8; // sides of a cell, closer than which it is measured by PARTS x PARTS points;
const [NEAR_CONE, WIDEST] = [64, 1.5]; // of a spot whose outer half-angle has a versine below that one, whose cone may end in it
const PARTS = 4;
const TILT = 0.25; // of the nearness of a cell: how much the depth of its plane may vary within one texel of a shadow map
const SLACK = 1e-4;
const EDGE = 0.1; // of the depth: what is nearer by more is another surface

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
    profileAcross: vector(),
    profileUp: vector(),
    profileTangent: uniform(0),
  } as Record<string, N>;
}

export interface CellTextures {
  places: Texture;
  normals: Texture;
  /** A texture node whose red is 1 on cells that the look shines on, else 0. */
  chosen: N;
  lift: number;
}

/** Six faces about a place, or one map of a direction, `size` texels per side. */
export interface OwnMaps {
  maps: readonly Texture[];
  size: number;
}

/** A node of how much of a light a lifted cell sees. */
export type Visibility = (place: N, normal: N) => N;

/** RGBA of the pass: what `former` holds, and the look's irradiance; `profile`: a texture node of it, where the light has one. */
export function irradianceNode(u: Record<string, N>, cells: CellTextures, former: Texture, distant: boolean, visibility: Visibility, profile?: N): N {
  return Fn(() => {
    const at = ivec2(screenCoordinate).toVar();
    const cell = textureLoad(cells.places, at).toVar();
    const normal = textureLoad(cells.normals, at).xyz.toVar();
    const amount = (distant ? vec3(max(dot(normal, u.light), 0)) : fromPlace(u, cell, normal, profile)).toVar();
    amount.mulAssign(textureLoad(cells.chosen, at).r);
    If(dot(amount, vec3(1)).greaterThan(0), () => {
      const place = cell.xyz.add(normal.mul(cells.lift)).toVar();
      amount.mulAssign(visibility(place, normal));
    });
    return vec4(textureLoad(former, at).rgb.add(u.color.mul(amount)), 1);
  })();
}

/** `srbfCellIrradiance`, or with a profile `srbfProfiledIrradiance`: at the middle of a cell far away, else at 4 x 4 points of a square. */
function fromPlace(u: Record<string, N>, cell: N, normal: N, profile?: N): N {
  const part = (toward: N, least: N): N => {
    const amount = falling(u, toward, normal, least);
    return profile ? shapedBy(u, profile, toward.negate().toVar()).mul(amount) : vec3(amount);
  };
  const toward = u.light.sub(cell.xyz).toVar();
  const least = cell.w.div(2 * Math.PI).toVar();
  const amount = part(toward, least).toVar();
  const sides = select(u.versineOuter.lessThan(WIDEST), float(NEAR_CONE), float(NEAR));
  If(dot(toward, toward).lessThan(cell.w.mul(sides.mul(sides))), () => {
    amount.assign(vec3(0));
    const [tangent, bitangent] = tangents(normal);
    each(PARTS, "s", (s) =>
      each(PARTS, "t", (t) => {
        const place = (i: N) => float(i).add(0.5).div(PARTS).sub(0.5).mul(sqrt(cell.w));
        const there = toward.sub(tangent.mul(place(s))).sub(bitangent.mul(place(t))).toVar();
        amount.addAssign(part(there, least.div(PARTS ** 2)).div(PARTS ** 2));
      }),
    );
  });
  return amount;
}

/** `srbfProfile`: the factor of a light's color in a direction from it, bilinear; the profile is about the look's axis. */
function shapedBy(u: Record<string, N>, profile: N, away: N): N {
  const [x, y, ahead] = [u.profileAcross, u.profileUp, u.axis].map((axis) => dot(away, axis).toVar());
  const most = vec2(textureSize(profile, int(0))).sub(1).toVar();
  const place = vec2(0).toVar();
  const shines = float(1).toVar();
  If(u.profileTangent.greaterThan(0), () => {
    shines.assign(select(ahead.greaterThan(0), float(1), float(0)));
    const side = vec2(x, y.negate()).mul(float(0.5).div(max(ahead, 1e-15).mul(u.profileTangent))).add(0.5);
    place.assign(clamp(side.mul(most.add(1)).sub(0.5), vec2(0), most));
  }).Else(() => {
    const off = length(vec2(x, y)).toVar();
    const onAxis = off.lessThanEqual(0);
    const azimuth = select(onAxis, float(0), atan(x, y));
    const polar = select(onAxis, select(ahead.lessThan(0), float(Math.PI), float(0)), atan(off, ahead));
    place.assign(clamp(vec2(azimuth.div(2 * Math.PI).add(0.5), polar.div(Math.PI)).mul(most), vec2(0), most));
  });
  const low = ivec2(place).toVar();
  const high = ivec2(min(vec2(low).add(1), most)).toVar();
  const part = place.sub(vec2(low)).toVar();
  const fetch = (column: N, row: N): N => textureLoad(profile, ivec2(column, row)).rgb;
  const [top, bottom] = [low.y, high.y].map((row) => mix(fetch(low.x, row), fetch(high.x, row), part.x));
  return mix(top, bottom, part.y).mul(shines);
}

/** Two unit vectors across a normal and each other [Duff2017]. */
export function tangents(normal: N): [N, N] {
  const side = select(normal.z.greaterThanEqual(0), float(1), float(-1)).toVar();
  const a = float(-1).div(side.add(normal.z)).toVar();
  const b = normal.x.mul(normal.y).mul(a).toVar();
  const across = vec3(side.mul(normal.x).mul(normal.x).mul(a).add(1), side.mul(b), side.mul(normal.x).negate()).toVar();
  return [across, vec3(b, normal.y.mul(normal.y).mul(a).add(side), normal.y.negate()).toVar()];
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

/** Which of six faces about a place, in its axes, looks along `away`, and where it falls there, from -1 to 1. */
function onCube(away: N) {
  const most = abs(away).toVar();
  const axis = select(most.x.greaterThanEqual(most.y).and(most.x.greaterThanEqual(most.z)), int(0), select(most.y.greaterThanEqual(most.z), int(1), int(2))).toVar();
  const turned = (v: N): N => select(axis.equal(0), v.yzx, select(axis.equal(1), v.zxy, v));
  const own = turned(away).toVar();
  const side = select(own.z.greaterThanEqual(0), float(1), float(-1)).toVar();
  const depth = abs(own.z).toVar();
  const face = axis.mul(2).add(select(side.lessThan(0), int(1), int(0))).toVar();
  return { face, side, depth, turned, at: own.xy.div(depth) as N };
}

/** The nearest surface at the texel that a lifted cell falls on, against the cell's plane at the texel's middle. */
export const seenFromPlace = (u: Record<string, N>, { maps, size }: OwnMaps): Visibility => (place, normal) => {
  const away = place.sub(u.light).toVar();
  const { face, side, depth, turned, at } = onCube(away);
  const { texel, middle } = texelOf(at, size);
  const plane = dot(turned(normal), vec3(middle, side)).div(dot(normal, away));
  const limited = clamp(plane, float(1 - TILT).div(depth), float(1 + TILT).div(depth));
  const nearness = float(0).toVar();
  maps.forEach((map, i) => {
    If(face.equal(i), () => {
      nearness.assign(textureLoad(map, texel).r);
    });
  });
  return select(nearness.greaterThan(limited.mul(1 + SLACK)), float(0), float(1));
};

/** The nearest surfaces about a lifted cell whose plane is not known: its normal is a mean over several faces. */
export const seenAround = (u: Record<string, N>, { maps, size }: OwnMaps): Visibility => (place) => {
  const { face, depth, at } = onCube(place.sub(u.light).toVar());
  const visible = float(0).toVar();
  maps.forEach((map, i) => {
    If(face.equal(i), () => {
      visible.assign(surfelVisibility(map, size, at, depth.reciprocal()));
    });
  });
  return visible;
};

export const seenAlong = (u: Record<string, N>, { maps, size }: OwnMaps): Visibility => (place) =>
  surfelVisibility(maps[0], size, vec2(dot(place, u.across), dot(place, u.up)).div(u.reach), dot(place, u.light).add(u.reach.mul(2)));

/** `srbfSurfelVisibility`: `at` from -1 to 1, `own`: what the map holds of the place itself. */
function surfelVisibility(map: Texture, size: number, at: N, own: N): N {
  const texel = vec2(at.x, at.y.negate()).mul(0.5 * size).add(0.5 * (size - 1)).toVar();
  const base = clamp(floor(texel), vec2(0), vec2(size - 2)).toVar();
  const part = texel.sub(base).toVar(); // past the middles of the outermost texels the plane goes on
  const [nearer, excess] = [float(0).toVar(), float(0).toVar()];
  for (const [x, y] of [[0, 0], [1, 0], [0, 1], [1, 1]]) {
    const share = (x ? part.x : part.x.oneMinus()).mul(y ? part.y : part.y.oneMinus()).toVar();
    const above = max(textureLoad(map, ivec2(base).add(ivec2(x, y))).r.div(own).sub(1), -EDGE).toVar();
    nearer.addAssign(select(above.greaterThan(EDGE), share, float(0)));
    excess.addAssign(share.mul(above));
  }
  return select(nearer.notEqual(0), clamp(nearer.oneMinus(), 0, 1), select(excess.greaterThan(SLACK), float(0), float(1)));
}

export const seenFromFar = (u: Record<string, N>, { maps, size }: OwnMaps): Visibility => (place, normal) => {
  const { texel, middle } = texelOf(vec2(dot(place, u.across), dot(place, u.up)).div(u.reach), size);
  const slope = vec2(dot(normal, u.across), dot(normal, u.up));
  const plane = dot(normal, place).sub(dot(slope, middle.mul(u.reach))).div(dot(normal, u.light));
  const own = dot(place, u.light).toVar();
  const limited = clamp(plane, own.sub(TILT), own.add(TILT));
  return select(textureLoad(maps[0], texel).r.greaterThan(limited.add(u.reach.mul(2))), float(0), float(1));
};
