/** Shadow maps of the asset's own triangles for WebGPURenderer: `OccluderMaps`, a target to a face. */
import { DoubleSide, FloatType, Mesh, NearestFilter, NoBlending, OrthographicCamera, RedFormat, RenderTarget, Vector3 } from "three";
import * as tsl from "three/tsl";
import { NodeMaterial, type Renderer } from "three/webgpu";
import { unit } from "../../lights";
import { cross, type Triple } from "../../matrix";
import { OccluderGeometry } from "../occluder_geometry";
import type { N } from "./nodes";

const { dot, positionGeometry, uniform, varying, vec4 } = tsl as Record<string, N>;
const NEAREST = 5e-3; // meters

export class OccluderNodes {
  readonly faces: readonly RenderTarget[];
  readonly far: RenderTarget;
  private readonly geometry: OccluderGeometry;
  private readonly uniforms = { light: uniform(new Vector3()), across: uniform(new Vector3()), up: uniform(new Vector3()), ahead: uniform(new Vector3()), nearest: uniform(NEAREST) } as Record<string, N>;
  private readonly near: Mesh;
  private readonly distant: Mesh;
  private readonly camera = new OrthographicCamera();

  /** `corners` less `middle`; all within `reach` (m) of it. `size`: texels per side of a face, a quarter of those of a directional map. */
  constructor(corners: Float32Array, middle: Triple, readonly reach: number, readonly size: number) {
    this.geometry = new OccluderGeometry(corners, middle);
    const target = (side: number) => new RenderTarget(side, side, { format: RedFormat, type: FloatType, magFilter: NearestFilter, minFilter: NearestFilter });
    this.faces = Array.from({ length: 6 }, () => target(size));
    this.far = target(4 * size);
    const { light, across, up, ahead, nearest } = this.uniforms;
    const away = positionGeometry.sub(light);
    const depth = dot(away, ahead);
    this.near = this.mesh(vec4(dot(away, across), dot(away, up), depth.sub(nearest), depth), varying(depth).reciprocal());
    const height = dot(positionGeometry, ahead).add(2 * reach);
    this.distant = this.mesh(vec4(dot(positionGeometry, across).div(reach), dot(positionGeometry, up).div(reach), height.div(-4 * reach).add(1), 1), varying(height));
  }

  /** Draw what a light at a place sees. What is nearer to it than `nearest` (m) casts no shadow; `casting`: of each triangle whether it casts one, all of them without. */
  drawNear(renderer: Renderer, place: Triple, nearest = NEAREST, casting?: Uint8Array): void {
    this.near.geometry = this.geometry.of(casting);
    this.uniforms.light.value.set(...place);
    this.uniforms.nearest.value = nearest;
    this.faces.forEach((face, i) => {
      const k = i >> 1;
      const along = (axis: number, value = 1) => [0, 1, 2].map((c) => (c === axis % 3 ? value : 0));
      this.look(along(k + 1), along(k + 2), along(k, i % 2 ? -1 : 1));
      renderer.setRenderTarget(face);
      renderer.render(this.near, this.camera);
    });
  }

  /** Draw what a light in a direction sees, of what is `casting`; the axes of the map. */
  drawFar(renderer: Renderer, direction: Triple, casting?: Uint8Array): { across: Triple; up: Triple } {
    this.distant.geometry = this.geometry.of(casting);
    const across = unit(Math.abs(direction[2]) < 0.9 ? cross([0, 0, 1], direction) : cross([1, 0, 0], direction));
    const up = cross(direction, across);
    this.look(across, up, direction);
    renderer.setRenderTarget(this.far);
    renderer.render(this.distant, this.camera);
    return { across, up };
  }

  dispose(): void {
    for (const one of [...this.faces, this.far, this.geometry, this.near.material as NodeMaterial, this.distant.material as NodeMaterial]) one.dispose();
  }

  private look(across: readonly number[], up: readonly number[], ahead: readonly number[]): void {
    for (const [name, value] of Object.entries({ across, up, ahead })) this.uniforms[name].value.set(...value);
  }

  private mesh(position: N, nearness: N): Mesh {
    const material = new NodeMaterial();
    material.vertexNode = position;
    material.fragmentNode = vec4(nearness, 0, 0, 1);
    material.side = DoubleSide;
    material.blending = NoBlending;
    const mesh = new Mesh(this.geometry.of(), material);
    mesh.frustumCulled = false;
    return mesh;
  }
}
