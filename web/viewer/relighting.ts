/** The asset relit, with what only the page needs: environment weights that are computed once, and what the clamp cuts off. */
import type { Matrix4 } from "three";
import { type EnvironmentLight, type FrameValues, frameValues, type Light, type Triple } from "../src";
import { SrbfRelightingMap } from "../src/three";

export class ViewerRelighting extends SrbfRelightingMap {
  private readonly environments = new WeakMap<object, Float32Array>();

  /** Weights are linear in a light's color: an environment's are integrated once, for white. */
  protected override frame(): FrameValues {
    const lights = this.currentLights();
    const frame = frameValues(this.asset, lights.filter((light) => light.kind !== "environment"));
    for (const light of lights) if (light.kind === "environment") add(frame.weights, this.environmentWeights(light), light.color);
    return frame;
  }

  /** From a model in the asset's frame, y up as in glTF, to three's world. */
  sceneFromModel(): Matrix4 {
    return this.assetFromScene().invert().multiply(this.worldFromScene);
  }

  set(lights: readonly Light[]): void {
    this.lights.splice(0, this.lights.length, ...lights);
  }

  private environmentWeights(light: EnvironmentLight): Float32Array {
    const key = light.pixels as object;
    let weights = this.environments.get(key);
    if (!weights) {
      weights = frameValues(this.asset, [{ ...light, color: [1, 1, 1] }]).weights;
      this.environments.set(key, weights);
    }
    return weights;
  }
}

/** The lights with negated colors: relit by them, an asset shows what the clamp cuts off. */
export function negated(lights: readonly Light[]): Light[] {
  return lights.map((light) => ({ ...light, color: light.color.map((x) => -x) as unknown as Triple }));
}

function add(weights: Float32Array, environment: Float32Array, color: Triple): void {
  for (let i = 0; i < weights.length; i += 4) for (let c = 0; c < 3; ++c) weights[i + c] += environment[i + c] * color[c];
}
