/** The asset relit, with what only the page needs: where it is, its lights at once, and what the clamp cuts off. */
import type { Matrix4 } from "three";
import type { Light, Triple } from "../src";
import { SrbfRelightingMap } from "../src/three";

export class ViewerRelighting extends SrbfRelightingMap {
  /** From a model in the asset's frame, y up as in glTF, to three's world. */
  sceneFromModel(): Matrix4 {
    return this.assetFromScene().invert().multiply(this.worldFromScene);
  }

  set(lights: readonly Light[]): void {
    this.lights.splice(0, this.lights.length, ...lights);
  }
}

/** The lights with negated colors: relit by them, an asset shows what the clamp cuts off. */
export function negated(lights: readonly Light[]): Light[] {
  return lights.map((light) => ({ ...light, color: light.color.map((x) => -x) as unknown as Triple }));
}
