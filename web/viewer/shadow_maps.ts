/** A shadow map of opaque triangles, one of translucent walls, and what those let through; and the pass that adds the light of one look at them. */
import {
  AddEquation,
  BufferAttribute,
  BufferGeometry,
  Camera,
  Color,
  CustomBlending,
  DataTexture,
  DstColorFactor,
  FloatType,
  GLSL3,
  HalfFloatType,
  type IUniform,
  LinearFilter,
  MaxEquation,
  Mesh,
  NearestFilter,
  NoColorSpace,
  OneFactor,
  type PixelFormat,
  RawShaderMaterial,
  RedFormat,
  RGBAFormat,
  Scene,
  type Texture,
  type TextureDataType,
  type TextureFilter,
  UnsignedByteType,
  type WebGLRenderer,
  WebGLRenderTarget,
  ZeroFactor,
} from "three";
import fullscreenVertex from "../../glsl/stages/fullscreen.vert";
import type { Triple } from "../src";
import type { LightChoice } from "./linked_pixels";
import type { Caster } from "./shadow_casters";

export type Uniforms = Record<string, IUniform>;

const EVERYWHERE = new DataTexture(new Uint8Array([255]), 1, 1, RedFormat, UnsignedByteType);
EVERYWHERE.needsUpdate = true;

/** Where light is looked up: points and normals of every texel, several of each, and what a texel makes of irradiance. */
export interface LitTexels {
  readonly corners: readonly { points: Texture; normals: Texture }[];
  readonly reflectance: Texture;
  /** What texels reflect toward the eye beside that: uniforms of the pack's stages with SRBF_LOBES. */
  readonly lobes?: { readonly glossy: DataTexture; readonly lobes: DataTexture; readonly lobeAlbedo: DataTexture; readonly eye: readonly number[] };
}

/** Shaders of one kind of projection. */
export interface Stages {
  vertex: string;
  height: string;
  transmittance: string;
  direct: string;
}

export class ShadowMaps {
  private readonly heights: WebGLRenderTarget;
  private readonly wallHeights: WebGLRenderTarget;
  private readonly transmittances: WebGLRenderTarget;
  private readonly occluders = new Scene();
  private readonly walls = new Scene();
  private readonly translucent = new Scene();
  private readonly camera = new Camera();
  /** Meshes of what has a name, which a light may choose. */
  private readonly named: { name: string; mesh: Mesh }[] = [];
  private readonly lookups: readonly { own: LitTexels; material: RawShaderMaterial; quad: Scene }[];

  /** `projection`: uniforms of all stages, set before every `add`; `nothing`: what a height map holds where there is nothing. */
  constructor(
    private readonly renderer: WebGLRenderer,
    lit: readonly LitTexels[],
    casters: readonly Caster[],
    stages: Stages,
    projection: Uniforms,
    size: number,
    private readonly nothing: number,
  ) {
    this.heights = renderTarget(size, size, RedFormat, FloatType);
    this.wallHeights = renderTarget(size, size, RedFormat, FloatType);
    this.transmittances = renderTarget(size, size, RGBAFormat, HalfFloatType, LinearFilter);
    const { vertex: vertexShader } = stages;
    const height = new RawShaderMaterial({ glslVersion: GLSL3, vertexShader, fragmentShader: stages.height, uniforms: projection, ...blending("max") });
    const cast = (into: Scene, { geometry, name }: Caster, material: RawShaderMaterial) => {
      const mesh = unculled(geometry, material);
      into.add(mesh);
      if (name !== undefined) this.named.push({ name, mesh });
    };
    for (const caster of casters) {
      const { curve } = caster;
      cast(curve ? this.walls : this.occluders, caster, height);
      if (!curve) continue;
      const uniforms = { ...projection, curve: { value: curve } };
      const passing = new RawShaderMaterial({ glslVersion: GLSL3, vertexShader, fragmentShader: stages.transmittance, uniforms, ...blending("multiply") });
      cast(this.translucent, caster, passing);
    }
    const corner = new BufferGeometry();
    corner.setAttribute("corner", new BufferAttribute(new Float32Array([-1, -1, 3, -1, -1, 3]), 2));
    corner.setDrawRange(0, 3);
    this.lookups = lit.map((own) => {
      const material = new RawShaderMaterial({
        glslVersion: GLSL3,
        vertexShader: fullscreenVertex,
        fragmentShader: colored(stages.direct),
        defines: own.lobes ? { SRBF_LOBES: 1 } : {},
        uniforms: {
          ...projection,
          points: { value: null },
          normals: { value: null },
          heights: { value: this.heights.texture },
          wallHeights: { value: this.wallHeights.texture },
          transmittance: { value: this.transmittances.texture },
          reflectance: { value: own.reflectance },
          lit: { value: EVERYWHERE },
          weight: { value: [0, 0, 0] },
          ...Object.fromEntries(Object.entries(own.lobes ?? {}).map(([name, value]) => [name, { value }])),
        },
        ...blending("add"),
      });
      const quad = new Scene();
      quad.add(unculled(corner, material));
      return { own, material, quad };
    });
  }

  /** Draw the maps, and add the light of a light of `color` to `sum`, as it chooses. */
  add(sum: WebGLRenderTarget, color: Triple, { lit, casts }: LightChoice): void {
    const { renderer } = this;
    for (const { name, mesh } of this.named) mesh.visible = casts?.(name) ?? true;
    clear(renderer, this.heights, this.nothing);
    renderer.render(this.occluders, this.camera);
    clear(renderer, this.wallHeights, this.nothing);
    clear(renderer, this.transmittances, 1);
    if (this.walls.children.length) {
      renderer.setRenderTarget(this.wallHeights);
      renderer.render(this.walls, this.camera);
      renderer.setRenderTarget(this.transmittances);
      renderer.render(this.translucent, this.camera);
    }
    renderer.setRenderTarget(sum);
    for (const { own, material, quad } of this.lookups) {
      const { uniforms } = material;
      uniforms.lit.value = lit ?? EVERYWHERE;
      uniforms.weight.value = color.map((value) => value / own.corners.length);
      for (const { points, normals } of own.corners) {
        uniforms.points.value = points;
        uniforms.normals.value = normals;
        renderer.render(quad, this.camera);
      }
    }
  }
}

export function clear(renderer: WebGLRenderer, place: WebGLRenderTarget, value: number): void {
  renderer.setRenderTarget(place);
  renderer.setClearColor(new Color(value, value, value), 1);
  renderer.clear(true, false, false);
}

export function renderTarget(width: number, height: number, format: PixelFormat, type: TextureDataType, filter: TextureFilter = NearestFilter): WebGLRenderTarget {
  return new WebGLRenderTarget(width, height, { format, type, depthBuffer: false, magFilter: filter as never, minFilter: filter as never, colorSpace: NoColorSpace });
}

export function floatTexture(data: Float32Array, width: number, height: number): DataTexture {
  const made = new DataTexture(data as never, width, height, RGBAFormat, FloatType);
  made.needsUpdate = true;
  return made;
}

/** The pack's stage with a light's color, with each texel's response to irradiance, and with nothing on texels that are not lit. */
function colored(stage: string): string {
  return stage
    .replace("void main() {\n    ivec2 at = ivec2(gl_FragCoord.xy);", "$&\n    if (texelFetch(lit, min(at, textureSize(lit, 0) - 1), 0).r == 0.0) discard;")
    .replace("uniform float weight;", "uniform vec3 weight;\nuniform sampler2D reflectance;\nuniform sampler2D lit;")
    .replace(/ \* weight,/, " * weight * texelFetch(reflectance, at, 0).rgb,");
}

function blending(kind: "add" | "max" | "multiply") {
  const factors = kind === "multiply" ? { blendSrc: DstColorFactor, blendDst: ZeroFactor } : { blendSrc: OneFactor, blendDst: OneFactor };
  return { blending: CustomBlending, blendEquation: kind === "max" ? MaxEquation : AddEquation, ...factors, depthTest: false, depthWrite: false, side: 2 } as const;
}

function unculled(geometry: BufferGeometry, material: RawShaderMaterial): Mesh {
  const mesh = new Mesh(geometry, material);
  mesh.frustumCulled = false;
  return mesh;
}
