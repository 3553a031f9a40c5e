/** The light of all lamps and far lights at a place, after the clamp and with the ambient light: `srbfRelit` in nodes. */
import type { DataTexture } from "three";
import { Fn, If, int, ivec2, Loop, max, textureLoad, vec3 } from "three/tsl";
import type { NodeInputs } from "./inputs";
import { pointLightAt, least, type N, octahedralEncode, octahedralLookup, texelAt, versine, weight } from "./nodes";

/** vec3 at `uv` (v downwards), `receiver` in the asset's frame (meters). Of clustered assets it is the light of the texel that `uv` lies in. */
export function relit(inputs: NodeInputs, uv: N, receiver: N): N {
  return (Fn as N)(() => {
    const place = uv.toVar();
    const point = receiver.toVar();
    const sum = vec3(0).toVar();
    const methods = inputs.asset.basis.kind === "gaussian" ? relightingMap : scalarPlanes;
    methods(inputs, place, point, sum);
    return max(sum, vec3(0)).add(inputs.ambient(place));
  })();
}

function relightingMap(inputs: NodeInputs, uv: N, receiver: N, sum: N): void {
  const { basis, layers } = inputs.asset;
  if (basis.kind !== "gaussian") return;
  const { table } = inputs.textures;
  each(layers.count, "k", (k) => sum.addAssign(inputs.decoded(uv, k).rgb.mul(inputs.weights.element(k).rgb)));
  each(inputs.pointLightCount, "l", (l) => {
    const { light, direction } = pointLightAt(inputs.pointLights, l, receiver);
    const color = light.toVar();
    If(color.length().greaterThan(0), () => {
      const response = vec3(0).toVar();
      each(layers.count, "m", (m) => {
        const cosine = versine(direction, inputs.centers.element(m).xyz).oneMinus();
        response.addAssign(inputs.decoded(uv, m).rgb.mul(weight(table, basis.table.length, cosine)));
      });
      sum.addAssign(color.mul(response));
    });
  });
}

function scalarPlanes(inputs: NodeInputs, uv: N, receiver: N, sum: N): void {
  const { basis, layers, manifest } = inputs.asset;
  if (basis.kind === "gaussian") return;
  const { scalars, tableSize, wTable } = basis;
  const columns = wTable.width / tableSize;
  const lookup = octahedralLookup(inputs.textures.table, tableSize, columns);
  const weights = inputs.textures.weights as DataTexture;
  const texel = texelAt(uv, manifest.width, manifest.height);
  const cluster = inputs.textures.clusters ? int((textureLoad(inputs.textures.clusters, texel) as N).r.mul(255).add(0.5)).toVar() : int(0).toVar();
  /** w_0 plus the sum over scalars of a_j w_j, `function_` giving w_j. */
  const combined = (function_: (j: N) => N, loop: string) => {
    const response = function_(int(0)).toVar();
    each(layers.count, loop, (i) => {
      const values = inputs.decoded(uv, i).toVar();
      [values.x, values.y, values.z, values.w].forEach((value, c) => {
        response.addAssign(function_(least(i.mul(4).add(c + 1), scalars)).mul(value)); // an unused channel is 0 and takes the last weight
      });
    });
    return response;
  };
  sum.addAssign(combined((j) => (textureLoad(weights, ivec2(j, cluster)) as N).rgb, "k"));
  each(inputs.pointLightCount, "l", (l) => {
    const { light, direction } = pointLightAt(inputs.pointLights, l, receiver);
    const color = light.toVar();
    If(color.length().greaterThan(0), () => {
      const place = octahedralEncode(direction).toVar();
      const first = cluster.mul(scalars + 1).toVar();
      sum.addAssign(color.mul(combined((j) => lookup(first.add(j), place), "m")));
    });
  });
}

function each(count: number | N, name: string, body: (i: N) => void): void {
  const end = typeof count === "number" ? int(count) : count;
  (Loop as N)({ start: int(0), end, type: "int", condition: "<", name }, (variables: N) => body(variables[name]));
}
