/** One triangle over a whole target, drawn by a WebGLRenderer whose state is left as it was. */
import { BufferAttribute, BufferGeometry, Camera, Color, GLSL3, type IUniform, Mesh, NoBlending, RawShaderMaterial, type WebGLRenderer, type WebGLRenderTarget } from "three";

export const FULLSCREEN_VERTEX = `precision highp float;
in vec3 position;
void main() {
    gl_Position = vec4(position.xy, 0.0, 1.0);
}`;

export function fullscreenTriangle(): BufferGeometry {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]), 3));
  return geometry;
}

export class FullscreenPass {
  readonly uniforms: Record<string, IUniform>;
  private readonly mesh: Mesh<BufferGeometry, RawShaderMaterial>;
  private readonly camera = new Camera();

  constructor(fragmentShader: string, uniforms: Record<string, IUniform>, defines: Record<string, number> = {}) {
    this.uniforms = uniforms;
    const material = new RawShaderMaterial({ glslVersion: GLSL3, uniforms, vertexShader: FULLSCREEN_VERTEX, fragmentShader, defines, blending: NoBlending, depthTest: false, depthWrite: false });
    this.mesh = new Mesh(fullscreenTriangle(), material);
    this.mesh.frustumCulled = false;
  }

  draw(renderer: WebGLRenderer, target: WebGLRenderTarget): void {
    renderer.setRenderTarget(target);
    renderer.render(this.mesh, this.camera);
  }

  dispose(): void {
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }
}

/** Draw into some rows of a target alone. */
export function within(target: WebGLRenderTarget, first: number, rows: number, draw: (target: WebGLRenderTarget) => void): void {
  target.viewport.set(0, first, target.width, rows);
  try {
    draw(target);
  } finally {
    target.viewport.set(0, 0, target.width, target.height);
  }
}

/** Run `draw`; then the renderer's target, clear color and switches are what they were. */
export function undisturbed(renderer: WebGLRenderer, draw: () => void): void {
  const target = renderer.getRenderTarget();
  const [face, level] = [renderer.getActiveCubeFace(), renderer.getActiveMipmapLevel()];
  const [color, alpha] = [renderer.getClearColor(new Color()), renderer.getClearAlpha()];
  const { autoClear } = renderer;
  const [xr, shadows] = [renderer.xr.enabled, renderer.shadowMap.autoUpdate];
  renderer.autoClear = false;
  renderer.xr.enabled = false;
  renderer.shadowMap.autoUpdate = false;
  try {
    draw();
  } finally {
    renderer.setRenderTarget(target, face, level);
    renderer.setClearColor(color, alpha);
    renderer.autoClear = autoClear;
    renderer.xr.enabled = xr;
    renderer.shadowMap.autoUpdate = shadows;
  }
}
