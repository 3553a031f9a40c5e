/** An asset's numbers as nodes: textures, constant arrays, and the arrays that change with the lights. */
import { Matrix4, Vector4 } from "three";
import { int, ivec2, texture, textureLoad, uniform, uniformArray } from "three/tsl";
import type { Asset } from "../../asset";
import { SrbfError } from "../../errors";
import { packedPointLights } from "../../point_light";
import { type FrameValues, paddedCenters } from "../../shader";
import type { Filter, SrbfTextures } from "../textures";
import { POINT_LIGHT_ROWS, type N, texelAt } from "./nodes";

export class NodeInputs {
  readonly scale: N;
  readonly bias: N;
  readonly centers?: N;
  /** vec4 a map, of relighting maps. */
  readonly weights?: N;
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
  ) {
    this.scale = uniformArray(vectors(asset.scale), "vec4");
    this.bias = uniformArray(vectors(asset.bias), "vec4");
    this.weightVectors = asset.basis.kind === "gaussian" ? vectors(new Float32Array(4 * asset.layers.count)) : [];
    if (asset.basis.kind === "gaussian") {
      this.weights = uniformArray(this.weightVectors, "vec4");
      this.centers = uniformArray(vectors(paddedCenters(asset)), "vec4");
    }
    this.pointLightVectors = Array.from({ length: POINT_LIGHT_ROWS * maxPointLights }, () => new Vector4());
    this.pointLights = uniformArray(this.pointLightVectors, "vec4");
  }

  /** Four channels of layer `i`, as stored, at a place with v downwards. */
  layer(uv: N, i: N): N {
    const { width, height } = this.asset.manifest;
    if (this.filter === "nearest") return (textureLoad(this.textures.layers, texelAt(uv, width, height)) as N).depth(i);
    return (texture(this.textures.layers, uv) as N).depth(i).level(int(0));
  }

  /** As `layer`, decoded. */
  decoded(uv: N, i: N): N {
    return this.layer(uv, i).mul(this.scale.element(i)).add(this.bias.element(i));
  }

  ambient(uv: N): N {
    const { ambient } = this.textures;
    if (!this.asset.ambient) return (textureLoad(ambient, ivec2(0, 0)) as N).rgb;
    if (this.filter === "linear") return (texture(ambient, uv) as N).level(int(0)).rgb;
    return (textureLoad(ambient, texelAt(uv, this.asset.manifest.width, this.asset.manifest.height)) as N).rgb;
  }

  /** Write the numbers of a frame. @throws SrbfError on more lamps than there is room for. */
  set(frame: FrameValues): void {
    if (frame.pointLights.length > this.maxPointLights) {
      throw new SrbfError(`expected at most ${this.maxPointLights} lamps, found ${frame.pointLights.length}; set maxPointLights when the asset is loaded`);
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

function vectors(numbers: Float32Array): Vector4[] {
  return Array.from({ length: numbers.length / 4 }, (_, i) => new Vector4().fromArray(numbers, 4 * i));
}
