/** The asset's tables as compute shaders, for WebGPU: from the mean irradiance on patches to the weights, a workgroup per row of a table. */
import { type DataTexture, FloatType, NearestFilter, type RenderTarget, type Texture } from "three";
import * as tsl from "three/tsl";
import { type Renderer, StorageTexture } from "three/webgpu";
import { SrbfError } from "../../errors";
import type { LightValues } from "../../light_values";
import { each } from "./inputs";
import type { N } from "./nodes";
import { entryProduct, folded, type Numbers } from "./table_nodes";

const { Fn, If, int, invocationLocalIndex, textureLoad, textureStore, uvec2, vec3, vec4, workgroupArray, workgroupBarrier, workgroupId } = tsl as Record<string, N>;

const THREADS = 64; // of a workgroup, which share a row

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
      const made = storage(stage.width, stage.height);
      this.kernels.push({ node: rowsNode(stage, numbers, made).computeKernel([THREADS]), rows: stage.values.functions, made });
      numbers = { texture: made, width: stage.width };
    }
  }

  /** The weights, as the nodes of the asset take them. */
  get weights(): Texture {
    return this.kernels[this.kernels.length - 1].made;
  }

  /** @throws SrbfError on a renderer without compute shaders. */
  run(renderer: Renderer): void {
    if (!(renderer.backend as { isWebGPUBackend?: boolean }).isWebGPUBackend) throw new SrbfError('expected WebGPU for weights "compute", found its WebGL2 backend; take weights: "gpu"');
    for (const { node, rows } of this.kernels) (renderer as N).compute(node, [rows, 1, 1]);
  }

  dispose(): void {
    for (const { node, made } of this.kernels) {
      node.dispose();
      made.dispose();
    }
  }
}

/** Every thread adds up each 64th entry of its row; then halves of the threads' sums are added to the others, again and again. */
function rowsNode({ values, texture, scale, added, width }: Stage, numbers: Numbers, made: StorageTexture): N {
  const { count } = values;
  return Fn(() => {
    const sums = workgroupArray("vec3", THREADS);
    const row = int(workgroupId.x).toVar();
    const thread = int(invocationLocalIndex).toVar();
    const total = vec3(0).toVar();
    each(int(count + THREADS - 1).sub(thread).div(THREADS).toVar(), "i", (i) => {
      const column = i.mul(THREADS).add(thread).toVar();
      total.addAssign(entryProduct(values, texture, numbers, row, column));
    });
    sums.element(thread).assign(total);
    workgroupBarrier();
    for (let half = THREADS / 2; half >= 1; half /= 2) {
      If(thread.lessThan(half), () => sums.element(thread).addAssign(sums.element(thread.add(half))));
      workgroupBarrier();
    }
    If(thread.equal(0), () => {
      const at = folded(row, width).toVar();
      textureStore(made, uvec2(at), vec4(sums.element(int(0)).mul(scale).add(textureLoad(added, at).rgb), 1)).toWriteOnly();
    });
  })();
}

function storage(width: number, height: number): StorageTexture {
  const made = new StorageTexture(width, height);
  made.type = FloatType;
  made.magFilter = made.minFilter = NearestFilter;
  made.generateMipmaps = false;
  return made;
}
