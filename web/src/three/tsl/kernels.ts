/** Compute shaders that write a texture, a workgroup to a texel. */
import { FloatType, NearestFilter } from "three";
import * as tsl from "three/tsl";
import { type Renderer, StorageTexture } from "three/webgpu";
import { SrbfError } from "../../errors";
import type { N } from "./nodes";

const { Fn, If, int, invocationLocalIndex, textureStore, uvec2, vec4, workgroupArray, workgroupBarrier } = tsl as Record<string, N>;

export const THREADS = 64; // of a workgroup, which share a sum

/** Writes into `made` at the texel of a workgroup what `finish` makes of the sum of its threads' parts. */
export function summingKernel(made: StorageTexture, texel: () => N, part: (at: N, thread: N) => N, finish: (sum: N, at: N) => N): N {
  return Fn(() => {
    const sums = workgroupArray("vec3", THREADS);
    const at = texel().toVar();
    const thread = int(invocationLocalIndex).toVar();
    sums.element(thread).assign(part(at, thread));
    workgroupBarrier();
    for (let half = THREADS / 2; half >= 1; half /= 2) {
      If(thread.lessThan(half), () => sums.element(thread).addAssign(sums.element(thread.add(half))));
      workgroupBarrier();
    }
    If(thread.equal(0), () => {
      textureStore(made, uvec2(at), vec4(finish(sums.element(int(0)), at), 1)).toWriteOnly();
    });
  })().computeKernel([THREADS]);
}

export function compute(renderer: Renderer, kernel: N, groups: readonly [number, number, number]): void {
  (renderer as N).compute(kernel, groups);
}

/** @throws SrbfError on a renderer without compute shaders. */
export function checkComputes(renderer: Renderer): void {
  if (!(renderer.backend as { isWebGPUBackend?: boolean }).isWebGPUBackend) throw new SrbfError('expected WebGPU for weights "compute", found its WebGL2 backend; take weights: "gpu"');
}

export function floatStorage(width: number, height: number): StorageTexture {
  const made = new StorageTexture(width, height);
  made.type = FloatType;
  made.magFilter = made.minFilter = NearestFilter;
  made.generateMipmaps = false;
  return made;
}
