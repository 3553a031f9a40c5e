/** Shadow maps of the asset's own triangles, about a place or from a direction: small, since what they shadow are cells of surfaces. */
import { Camera, DoubleSide, GLSL3, Mesh, NearestFilter, NoBlending, RawShaderMaterial, RedFormat, FloatType, type Texture, type WebGLRenderer, WebGLRenderTarget } from "three";
import { unit } from "../lights";
import { cross, type Triple } from "../matrix";
import fragmentShader from "../shaders/occluder_nearness.glsl";
import vertexShader from "../shaders/occluder_corner.glsl";
import { OccluderGeometry } from "./occluder_geometry";

const NEAREST = 5e-3; // meters

/** What the lookup needs of the map that was drawn last. */
export interface DrawnMap {
  nearness: Texture;
  reach: number;
  across: Triple;
  up: Triple;
}

export class OccluderMaps {
  private readonly cube: WebGLRenderTarget;
  private readonly flat: WebGLRenderTarget;
  private readonly geometry: OccluderGeometry;
  private readonly uniforms = {
    light: { value: [0, 0, 0] as number[] },
    across: { value: [0, 0, 0] as number[] },
    up: { value: [0, 0, 0] as number[] },
    ahead: { value: [0, 0, 0] as number[] },
    reach: { value: 1 },
    nearest: { value: NEAREST },
  };
  private readonly near: Mesh;
  private readonly far: Mesh;
  private readonly camera = new Camera();

  /** `corners` less `middle`; `size`: texels per side of a face, a quarter of those of a directional map. */
  constructor(corners: Float32Array, middle: Triple, private readonly radius: number, private readonly size: number) {
    this.geometry = new OccluderGeometry(corners, middle);
    const target = (width: number, height: number) =>
      new WebGLRenderTarget(width, height, { format: RedFormat, type: FloatType, magFilter: NearestFilter, minFilter: NearestFilter });
    this.cube = target(3 * size, 2 * size);
    this.flat = target(4 * size, 4 * size);
    const mesh = (defines: Record<string, number>) => {
      const made = new Mesh(this.geometry.of(), new RawShaderMaterial({ glslVersion: GLSL3, uniforms: this.uniforms, vertexShader, fragmentShader, defines, side: DoubleSide, blending: NoBlending }));
      made.frustumCulled = false;
      return made;
    };
    this.near = mesh({});
    this.far = mesh({ SRBF_DISTANT: 1 });
  }

  /**
   * Draw what a light sees; `place` is its place, or the direction to a distant one. What is nearer to it than `nearest` (m) casts no shadow.
   * `casting`: of each triangle whether it casts one, all of them without. The renderer clears nothing by itself.
   */
  draw(renderer: WebGLRenderer, place: Triple, distant: boolean, nearest = NEAREST, casting?: Uint8Array): DrawnMap {
    const { uniforms, size, camera } = this;
    const target = distant ? this.flat : this.cube;
    this.near.geometry = this.far.geometry = this.geometry.of(casting);
    renderer.setClearColor(0, 0);
    if (distant) {
      const across = unit(Math.abs(place[2]) < 0.9 ? cross([0, 0, 1], place) : cross([1, 0, 0], place));
      const up = cross(place, across);
      set(uniforms, { across, up, ahead: place, reach: this.radius });
      renderer.setRenderTarget(target);
      renderer.clear(true, true, false);
      renderer.render(this.far, camera);
      return { nearness: target.texture, reach: this.radius, across, up };
    }
    set(uniforms, { light: place, reach: 1, nearest });
    target.viewport.set(0, 0, 3 * size, 2 * size);
    renderer.setRenderTarget(target);
    renderer.clear(true, true, false);
    for (let face = 0; face < 6; ++face) {
      const k = face >> 1;
      const along = (axis: number, value = 1) => [0, 1, 2].map((i) => (i === axis % 3 ? value : 0)) as unknown as Triple;
      set(uniforms, { across: along(k + 1), up: along(k + 2), ahead: along(k, face % 2 ? -1 : 1) });
      target.viewport.set((face % 3) * size, Math.floor(face / 3) * size, size, size);
      renderer.setRenderTarget(target);
      renderer.render(this.near, camera);
    }
    return { nearness: target.texture, reach: 1, across: [0, 0, 0], up: [0, 0, 0] };
  }

  dispose(): void {
    this.cube.dispose();
    this.flat.dispose();
    this.geometry.dispose();
    for (const mesh of [this.near, this.far]) (mesh.material as RawShaderMaterial).dispose();
  }
}

function set(uniforms: Record<string, { value: unknown }>, values: Record<string, unknown>): void {
  for (const [name, value] of Object.entries(values)) uniforms[name].value = value;
}
