/** Passes over a whole target for WebGPURenderer. */
import { NoBlending, type RenderTarget } from "three";
import { NodeMaterial, QuadMesh, type Renderer } from "three/webgpu";
import type { N } from "./nodes";

export interface Pass {
  quad: QuadMesh;
  target: RenderTarget;
}

export function pass(fragment: N, drawn: RenderTarget): Pass {
  const material = new NodeMaterial();
  material.fragmentNode = fragment;
  material.depthTest = false;
  material.depthWrite = false;
  material.blending = NoBlending;
  return { quad: new QuadMesh(material), target: drawn };
}

export function render(renderer: Renderer, { quad, target: drawn }: Pass): void {
  renderer.setRenderTarget(drawn);
  quad.render(renderer);
}

/** The passes' materials; their targets are not theirs alone. */
export function disposeOf(passes: readonly Pass[]): void {
  for (const { quad } of passes) (quad.material as NodeMaterial).dispose();
}
