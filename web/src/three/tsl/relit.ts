/** The light of all lights at a place, after the clamp and with the ambient light: `srbfRelit` in nodes. */
import { Fn, max, vec3 } from "three/tsl";
import type { NodeInputs } from "./inputs";
import type { N } from "./nodes";

/** vec3 at `uv` (v downwards), `receiver` in the asset's frame (meters). Layers that must not be filtered give the light of the texel that `uv` lies in. */
export function relit(inputs: NodeInputs, uv: N, receiver: N): N {
  return (Fn as N)(() => {
    const place = uv.toVar();
    const point = receiver.toVar();
    const sum = inputs.asset.tables.sum(inputs.kit, place, point);
    return max(sum, vec3(0)).add(inputs.ambient(place));
  })();
}
