/** What a method's node graph is made from. Nothing here imports three.js, so that the entry without an engine stays without one. */
import type * as pack from "../three/tsl/nodes";

type N = pack.N;

export interface NodeKit {
  /** The exports of three/tsl. */
  readonly tsl: Readonly<Record<string, N>>;
  /** Functions of the shader pack as nodes. */
  readonly pack: typeof pack;
  /** Number of stored layers. */
  readonly layers: number;
  /** Four decoded channels of layer `i` at `uv`. */
  decoded(uv: N, i: N): N;
  /** A uniform array of vec4: one of `Tables.vectors`, or `srbfWeights` where it is an array. */
  vectors(name: string): N;
  /** A texture for textureLoad: one of `Tables.textures`, or `srbfWeights` where it is a texture. */
  texture(name: string): N;
  /** The texel that `uv` lies in. */
  texelAt(uv: N): N;
  /** A loop; `name` names its counter, unlike that of a loop around it. */
  each(count: number | N, name: string, body: (i: N) => void): void;
  /** Add to `sum` color times `response(direction)` of each point and spot light at `receiver`; `response` is RGB. */
  addPointLights(sum: N, receiver: N, response: (direction: N) => N): void;
}
