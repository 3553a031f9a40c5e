/** The asset's tables as compute shaders, for WebGPU: from the mean irradiance on patches to the weights, a workgroup per row of a table. */
import type { DataTexture, RenderTarget, Texture } from "three";
import * as tsl from "three/tsl";
import type { Renderer, StorageTexture } from "three/webgpu";
import type { LightValues } from "../../light_values";
import { each } from "./inputs";
import { compute, floatStorage, summingKernel, THREADS } from "./kernels";
import type { N } from "./nodes";
import { entryProduct, folded, type Numbers } from "./table_nodes";

const { int, textureLoad, vec3, workgroupId } = tsl as Record<string, N>;

/** A table, its texture, what is added to its sums, and the sides of what it makes. */
export interface Stage {
  values: LightValues;
  texture: DataTexture;
  scale: number;
  added: DataTexture;
  width: number;
  height: number;
}

interface Kernel {
  node: N;
  rows: number;
  made: StorageTexture;
}

export class TableCompute {
  private readonly kernels: Kernel[] = [];

  /** `received`: the mean irradiance on patches, row by row. */
  constructor(stages: readonly Stage[], received: RenderTarget) {
    let numbers: Numbers = received;
    for (const stage of stages) {
      const made = floatStorage(stage.width, stage.height);
      this.kernels.push({ node: rowsNode(stage, numbers, made), rows: stage.values.functions, made });
      numbers = { texture: made, width: stage.width };
    }
  }

  /** The weights, as the nodes of the asset take them. */
  get weights(): Texture {
    return this.kernels[this.kernels.length - 1].made;
  }

  run(renderer: Renderer): void {
    for (const { node, rows } of this.kernels) compute(renderer, node, [rows, 1, 1]);
  }

  dispose(): void {
    for (const { node, made } of this.kernels) {
      node.dispose();
      made.dispose();
    }
  }
}

/** Every thread adds up each 64th entry of its row. */
function rowsNode({ values, texture, scale, added, width }: Stage, numbers: Numbers, made: StorageTexture): N {
  const { count } = values;
  const row = () => int(workgroupId.x);
  const part = (_: N, thread: N): N => {
    const total = vec3(0).toVar();
    each(int(count + THREADS - 1).sub(thread).div(THREADS).toVar(), "i", (i) => {
      const column = i.mul(THREADS).add(thread).toVar();
      total.addAssign(entryProduct(values, texture, numbers, row(), column));
    });
    return total;
  };
  return summingKernel(made, () => folded(row(), width), part, (sum, at) => sum.mul(scale).add(textureLoad(added, at).rgb));
}
