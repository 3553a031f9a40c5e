/** A lightmap with direct light at a higher resolution than its own, for meshes: bounces are smooth, shadows are not. */
import { FloatType, HalfFloatType, LinearFilter, RGBAFormat, type Texture, type WebGLRenderer, WebGLRenderTarget } from "three";
import { type Asset, receiverKind } from "../src";
import { FullscreenPass, undisturbed } from "../src/three/fullscreen";

const [LARGEST, MOST] = [1024, 4]; // texels per side; times the lightmap's resolution

const SUM = `precision highp float;
precision highp sampler2D;
uniform sampler2D lightmap, direct;
uniform bool alone;
out vec4 sum;
void main() {
    vec4 own = textureLod(lightmap, gl_FragCoord.xy / vec2(textureSize(direct, 0)), 0.0);
    sum = vec4((alone ? vec3(0.0) : own.rgb) + texelFetch(direct, ivec2(gl_FragCoord.xy), 0).rgb, own.a);
}`;

/** The resolution of direct light over that of the lightmap: 1 for views and vertices, and for large lightmaps. */
export function finenessOf({ manifest }: Asset): number {
  if (receiverKind(manifest) !== "lightmap") return 1;
  return Math.max(1, Math.min(MOST, Math.floor(LARGEST / Math.max(manifest.width, manifest.height))));
}

export class FineLightmap {
  private readonly target: WebGLRenderTarget;
  private readonly pass = new FullscreenPass(SUM, { lightmap: { value: null }, direct: { value: null }, alone: { value: false } });

  constructor(width: number, height: number, floats: boolean) {
    this.target = new WebGLRenderTarget(width, height, { type: floats ? FloatType : HalfFloatType, format: RGBAFormat, depthBuffer: false, magFilter: LinearFilter, minFilter: LinearFilter });
  }

  get texture(): Texture {
    return this.target.texture;
  }

  /** Direct light, of the target's size, added to a lightmap; only direct light with `alone`. */
  draw(renderer: WebGLRenderer, lightmap: Texture, direct: Texture, alone: boolean): void {
    const { uniforms } = this.pass;
    uniforms.lightmap.value = lightmap;
    uniforms.direct.value = direct;
    uniforms.alone.value = alone;
    undisturbed(renderer, () => this.pass.draw(renderer, this.target));
  }
}
