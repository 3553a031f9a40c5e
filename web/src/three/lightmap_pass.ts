/** Draws the asset into a texture of its own size whenever its light changes, to be filtered like any lightmap. */
import {
  type BufferGeometry,
  Camera,
  FloatType,
  GLSL3,
  HalfFloatType,
  LinearFilter,
  LinearMipmapLinearFilter,
  Mesh,
  NearestFilter,
  NoBlending,
  RawShaderMaterial,
  RGBAFormat,
  type Texture,
  type WebGLRenderer,
  WebGLRenderTarget,
} from "three";
import type { Asset } from "../asset";
import { shaderText } from "../shader";
import { FULLSCREEN_VERTEX, fullscreenTriangle, undisturbed } from "./fullscreen";
import type { Filter } from "./textures";
import type { Uniforms } from "./uniforms";

export interface TargetOptions {
  /** Precision of the lightmap. */
  target?: "half" | "float";
  /** How it is sampled. */
  filter?: Filter;
  /** Mip maps; coarse levels bleed between charts where the gutter is narrower. */
  mipmaps?: boolean;
  anisotropy?: number;
}

/** Added to the sum texel by texel, before the clamp: an indirect asset's direct light. */
export interface Added {
  texture: Texture;
  /** Whether the maps' own light is left out. */
  alone: boolean;
}

/** `srbfRelit` of every texel, and a view's coverage as straight alpha; row 0 of the target is the asset's top row. */
export class LightmapPass {
  readonly target: WebGLRenderTarget;
  private readonly mesh: Mesh<BufferGeometry, RawShaderMaterial>;
  private readonly camera = new Camera();
  private room = 0;
  private added: Added | undefined;

  constructor(
    private readonly asset: Asset,
    private readonly uniforms: Uniforms,
    options: TargetOptions = {},
  ) {
    const { width, height } = asset.manifest;
    const { target = "half", filter = "linear", mipmaps = false, anisotropy = 1 } = options;
    this.target = new WebGLRenderTarget(width, height, {
      type: target === "half" ? HalfFloatType : FloatType,
      format: RGBAFormat,
      depthBuffer: false,
      magFilter: filter === "linear" ? LinearFilter : NearestFilter,
      minFilter: mipmaps ? LinearMipmapLinearFilter : filter === "linear" ? LinearFilter : NearestFilter,
      generateMipmaps: mipmaps,
      anisotropy,
    });
    this.mesh = new Mesh(fullscreenTriangle(), new RawShaderMaterial());
    this.mesh.frustumCulled = false;
  }

  /** Draw it with the numbers that the uniforms hold; the renderer's state is restored. */
  draw(renderer: WebGLRenderer, added?: Added): void {
    if (added?.texture !== this.added?.texture || added?.alone !== this.added?.alone) this.room = 0;
    this.added = added;
    const room = (this.uniforms.srbfPointLights.value as Float32Array).length / 16;
    if (room !== this.room) this.compile(room);
    undisturbed(renderer, () => {
      renderer.setRenderTarget(this.target);
      renderer.render(this.mesh, this.camera);
    });
  }

  dispose(): void {
    this.target.dispose();
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }

  private compile(room: number): void {
    this.mesh.material.dispose();
    const { srbfPositions } = this.uniforms;
    const sum = this.added?.alone ? "vec3(0.0)" : "srbfSum(uv, 0.0, receiver)";
    const added = this.added ? " + texelFetch(srbfAdded, ivec2(gl_FragCoord.xy), 0).rgb" : "";
    const alpha = this.uniforms.srbfAlpha ? "texelFetch(srbfAlpha, ivec2(gl_FragCoord.xy), 0).r" : "1.0";
    const receiver = srbfPositions ? "texelFetch(srbfPositions, ivec2(gl_FragCoord.xy), 0).xyz" : "vec3(0.0)";
    this.mesh.material = new RawShaderMaterial({
      glslVersion: GLSL3,
      uniforms: { ...this.uniforms, srbfAdded: { value: this.added?.texture } },
      vertexShader: FULLSCREEN_VERTEX,
      fragmentShader: `precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;
${shaderText(this.asset, room)}
${srbfPositions ? "uniform highp sampler2D srbfPositions;" : ""}
${this.added ? "uniform highp sampler2D srbfAdded;" : ""}
${this.uniforms.srbfAlpha ? "uniform sampler2D srbfAlpha;" : ""}
out vec4 relit;
void main() {
    vec2 uv = gl_FragCoord.xy / vec2(textureSize(srbfLayers, 0).xy);
    vec3 receiver = ${receiver};
    relit = vec4(srbfFinish(${sum}${added}, textureLod(srbfAmbient, uv, 0.0).rgb), ${alpha});
}`,
      blending: NoBlending,
      depthTest: false,
      depthWrite: false,
    });
    this.room = room;
  }
}
