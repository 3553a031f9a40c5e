/** Passes over a whole target for WebGPURenderer. */
import { Color, FloatType, NearestFilter, NoBlending, RenderTarget } from "three";
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

export function floatTarget(width: number, height: number): RenderTarget {
  return new RenderTarget(width, height, { type: FloatType, magFilter: NearestFilter, minFilter: NearestFilter, depthBuffer: false });
}

/** Draw into rows of a target, whose others keep what they have. */
export function within(renderer: Renderer, target: RenderTarget, first: number, rows: number, draw: () => void): void {
  const { autoClear } = renderer;
  renderer.autoClear = false;
  target.viewport.set(0, first, target.width, rows);
  draw();
  renderer.autoClear = autoClear;
}

export function cleared(renderer: Renderer, target: RenderTarget): void {
  renderer.setRenderTarget(target);
  renderer.clear();
}

/** Draw with a black clear color; the renderer has its own target and color after it. */
export function undisturbed(renderer: Renderer, draw: () => void): void {
  const kept = { target: renderer.getRenderTarget(), color: renderer.getClearColor(new Color() as never) as unknown as Color, alpha: renderer.getClearAlpha() };
  renderer.setClearColor(new Color(0, 0, 0), 0);
  draw();
  renderer.setRenderTarget(kept.target);
  renderer.setClearColor(kept.color, kept.alpha);
}
