/** The light of probes in three.js' node language: `probe_harmonics.glsl` and `glsl/probes/`, by the same names. */
import type { Texture } from "three";
import * as tsl from "three/tsl";
import { FACETS, HARMONICS, harmonicWeights, LIGHT_TEXELS, PROBE_TILE, type Probes } from "../../probes";
import { gridOf, type ProbeTextures } from "../probe_light";
import { each } from "./inputs";
import { type N, octahedralEncode, octahedralLookup } from "./nodes";

const { abs, clamp, float, Fn, int, ivec2, ivec3, length, max, min, screenCoordinate, select, textureLoad, uniform, uniformArray, vec3, vec4 } = tsl as Record<string, N>;

const UNSEEN = 1e-5;
const SOFT = 0.1;

/** RGBA of the pass: four of a node's 27 numbers. */
export function harmonicsNode({ counts }: Probes, { places }: ProbeTextures, facets: Texture): N {
  const weights = uniformArray(harmonicWeights().flat(), "float");
  const [width] = counts;
  return Fn(() => {
    const at = ivec2(screenCoordinate).toVar();
    const source = int(textureLoad(places, ivec2(at.x.mod(width), at.y)).w.add(0.5)).toVar();
    const first = at.x.div(width).mul(4).toVar();
    const sums = [0, 1, 2, 3].map(() => float(0).toVar());
    each(FACETS, "f", (facet) => {
      const light = textureLoad(facets, ivec2(facet.mul(width).add(source.mod(width)), source.div(width))).rgb.toVar();
      sums.forEach((sum, i) => {
        const number = min(first.add(i), int(3 * HARMONICS - 1)).toVar(); // the last channel of all is not read
        const color = number.mod(3);
        const part = select(color.equal(0), light.x, select(color.equal(1), light.y, light.z));
        sum.addAssign(weights.element(facet.mul(HARMONICS).add(number.div(3))).mul(part));
      });
    });
    return vec4(...sums);
  })();
}

/** A function (place, unit normal), both in the asset's frame, that is the irradiance there, vec3. */
export function probeIrradiance(probes: Probes, { places, nearness }: ProbeTextures, light: Texture): (place: N, normal: N) => N {
  const grid = uniform(gridOf(probes));
  const counts = ivec3(...probes.counts);
  const most = probes.counts.map((count) => count - 1);
  const lookup = octahedralLookup(nearness, PROBE_TILE, probes.nearness.width / PROBE_TILE);
  const [x, y] = probes.counts;
  return Fn(([place, n]: N[]) => {
    const at = clamp(place.sub(grid.xyz).div(grid.w), vec3(0), vec3(...most)).toVar();
    const low = min(ivec3(at), ivec3(...most.map((end) => Math.max(end - 1, 0)))).toVar();
    const total = float(0).toVar();
    const sums = Array.from({ length: LIGHT_TEXELS }, () => vec4(0).toVar());
    each(8, "c", (corner) => {
      const node = min(low.add(ivec3(corner.mod(2), corner.div(2).mod(2), corner.div(4))), counts.sub(1)).toVar();
      const row = node.z.mul(y).add(node.y).toVar();
      const probe = textureLoad(places, ivec2(node.x, row)).toVar();
      const source = int(probe.w.add(0.5)).toVar();
      const way = place.sub(probe.xyz).toVar();
      const surface = lookup(source, octahedralEncode(way)).x;
      const seen = clamp(float(1).sub(length(way).mul(surface).sub(1).div(SOFT)), 0, 1).toVar();
      const own = select(source.equal(row.mul(x).add(node.x)), float(1), float(UNSEEN));
      const near = vec3(1).sub(abs(at.sub(vec3(node)))).toVar();
      const share = near.x.mul(near.y).mul(near.z).mul(max(seen.mul(seen), UNSEEN)).mul(own).toVar();
      total.addAssign(share);
      sums.forEach((sum, t) => sum.addAssign(textureLoad(light, ivec2(node.x.add(t * x), row)).mul(share)));
    });
    const [a, b, c, d, e, f, g] = sums;
    const sum = vec3(a.x, a.y, a.z).mul(0.886226925).toVar();
    sum.addAssign(vec3(a.w, b.x, b.y).mul(n.y).add(vec3(b.z, b.w, c.x).mul(n.z)).add(vec3(c.y, c.z, c.w).mul(n.x)).mul(1.023326708));
    sum.addAssign(vec3(d.x, d.y, d.z).mul(n.x.mul(n.y)).add(vec3(d.w, e.x, e.y).mul(n.y.mul(n.z))).add(vec3(f.y, f.z, f.w).mul(n.x.mul(n.z))).mul(0.858085531));
    sum.addAssign(vec3(e.z, e.w, f.x).mul(n.z.mul(n.z).mul(3).sub(1)).mul(0.247707956));
    sum.addAssign(vec3(g.x, g.y, g.z).mul(n.x.mul(n.x).sub(n.y.mul(n.y))).mul(0.429042765));
    return max(sum.div(total), vec3(0));
  }) as (place: N, normal: N) => N;
}
