/** An asset's numbers as nodes: textures, constant arrays, and the arrays that change with the lights. */
import { Matrix4, type Texture, Vector4 } from "three";
import * as tsl from "three/tsl";
import type { Asset } from "../../asset";
import { SrbfError } from "../../errors";
import { packedPointLights } from "../../point_light";
import type { NodeKit } from "../../methods/node_kit";
import { constantVectors, type FrameValues } from "../../shader";
import type { Filter, SrbfTextures } from "../textures";
import * as pack from "./nodes";
import { type N, POINT_LIGHT_ROWS, texelAt } from "./nodes";

const { If, int, ivec2, Loop, texture, textureLoad, uniform, uniformArray } = tsl;

export class NodeInputs {
  /** Uniform arrays of vec4, by name. */
  private readonly arrays: Record<string, N>;
  readonly pointLights: N;
  readonly pointLightCount: N = uniform(0, "int");
  readonly assetFromScene: N = uniform(new Matrix4());
  private readonly weightVectors: Vector4[];
  private readonly pointLightVectors: Vector4[];

  constructor(
    readonly asset: Asset,
    readonly textures: SrbfTextures,
    private readonly filter: Filter,
    private readonly maxPointLights: number,
    private readonly weights: Texture | undefined = textures.weights,
  ) {
    this.arrays = Object.fromEntries(Object.entries(constantVectors(asset)).map(([name, numbers]) => [name, uniformArray(vectors(numbers), "vec4")]));
    const { kind, width } = asset.tables.weights;
    this.weightVectors = kind === "uniform" ? vectors(new Float32Array(4 * width)) : [];
    if (kind === "uniform") this.arrays.srbfWeights = uniformArray(this.weightVectors, "vec4");
    this.pointLightVectors = Array.from({ length: POINT_LIGHT_ROWS * maxPointLights }, () => new Vector4());
    this.pointLights = uniformArray(this.pointLightVectors, "vec4");
  }

  /** Four channels of layer `i`, as stored, at a place with v downwards. */
  layer(uv: N, i: N): N {
    const { width, height } = this.asset.manifest;
    if (this.filter === "nearest") return (textureLoad(this.textures.layers, texelAt(uv, width, height)) as N).depth(i);
    return (texture(this.textures.layers, uv) as N).depth(i).level(int(0));
  }

  /** What the asset's method builds its sum from. */
  get kit(): NodeKit {
    return {
      tsl: tsl as Record<string, N>,
      pack,
      layers: this.asset.layers.count,
      decoded: (uv, i) => this.layer(uv, i).mul(this.arrays.srbfScale.element(i)).add(this.arrays.srbfBias.element(i)),
      vectors: (name) => this.arrays[name],
      texture: (name) => (name === "srbfWeights" ? this.weights : this.textures.tables[name]),
      texelAt: (uv) => pack.texelAt(uv, this.asset.manifest.width, this.asset.manifest.height),
      each,
      addPointLights: (sum, receiver, response) => this.addPointLights(sum, receiver, response),
    };
  }

  private addPointLights(sum: N, receiver: N, response: (direction: N) => N): void {
    each(this.pointLightCount, "l", (l) => {
      const { light, direction } = pack.pointLightAt(this.pointLights, l, receiver);
      const color = light.toVar();
      If(color.length().greaterThan(0), () => {
        sum.addAssign(color.mul(response(direction)));
      });
    });
  }

  ambient(uv: N): N {
    const { ambient } = this.textures;
    if (!this.asset.ambient) return (textureLoad(ambient, ivec2(0, 0)) as N).rgb;
    if (this.filter === "linear") return (texture(ambient, uv) as N).level(int(0)).rgb;
    return (textureLoad(ambient, texelAt(uv, this.asset.manifest.width, this.asset.manifest.height)) as N).rgb;
  }

  /** Write the numbers of one frame. @throws SrbfError on more point lights than there is room for. */
  set(frame: FrameValues): void {
    if (frame.pointLights.length > this.maxPointLights) {
      throw new SrbfError(`expected at most ${this.maxPointLights} point lights, found ${frame.pointLights.length}; set maxPointLights when the asset is loaded`);
    }
    this.weightVectors.forEach((vector, i) => vector.fromArray(frame.weights, 4 * i));
    const weights = this.textures.weights;
    if (weights) {
      (weights.image.data as Float32Array).set(frame.weights);
      weights.needsUpdate = true;
    }
    const packed = packedPointLights(frame.pointLights, this.maxPointLights);
    this.pointLightVectors.forEach((vector, i) => vector.fromArray(packed, 4 * i));
    this.pointLightCount.value = frame.pointLights.length;
  }
}

export function each(count: number | N, name: string, body: (i: N) => void): void {
  const end = typeof count === "number" ? int(count) : count;
  (Loop as N)({ start: int(0), end, type: "int", condition: "<", name }, (variables: N) => body(variables[name]));
}

function vectors(numbers: Float32Array): Vector4[] {
  return Array.from({ length: numbers.length / 4 }, (_, i) => new Vector4().fromArray(numbers, 4 * i));
}
