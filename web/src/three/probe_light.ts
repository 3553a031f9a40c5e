/** The light of probes on the GPU: their harmonics as a texture, drawn from the picture of their facets, and what shaders read besides. */
import { type DataTexture, FloatType, HalfFloatType, type IUniform, Matrix4, NearestFilter, RGBAFormat, type Texture, Vector4, type WebGLRenderer, WebGLRenderTarget } from "three";
import { harmonicWeights, LIGHT_TEXELS, type Probes } from "../probes";
import probeHarmonics from "../shaders/probe_harmonics.glsl";
import { FullscreenPass, undisturbed } from "./fullscreen";
import { tableTexture } from "./textures";

/** Of three's textures, shared by both renderers. */
export interface ProbeTextures {
  readonly places: DataTexture;
  readonly nearness: DataTexture;
}

export function probeTextures({ places, nearness }: Probes): ProbeTextures {
  return { places: tableTexture(places), nearness: tableTexture(nearness) };
}

/** Origin and spacing, as the shaders take them. */
export const gridOf = ({ origin, spacing }: Probes): Vector4 => new Vector4(...origin, spacing);

export class ProbeLight {
  /** Uniforms of `probe_light.glsl`, and of a material that reads it. */
  readonly uniforms: Readonly<Record<string, IUniform>>;
  private readonly target: WebGLRenderTarget;
  private readonly pass: FullscreenPass;
  private readonly textures: ProbeTextures;

  /** `facets`: the lightmap of the asset of probes. */
  constructor(probes: Probes, facets: Texture, precision: "half" | "float") {
    const [x, y, z] = probes.counts;
    this.textures = probeTextures(probes);
    const { places, nearness } = this.textures;
    const type = precision === "half" ? HalfFloatType : FloatType;
    this.target = new WebGLRenderTarget(LIGHT_TEXELS * x, y * z, { format: RGBAFormat, type, magFilter: NearestFilter, minFilter: NearestFilter, depthBuffer: false });
    this.pass = new FullscreenPass(probeHarmonics, { facets: { value: facets }, places: { value: places }, width: { value: x }, weights: { value: harmonicWeights().flat() } });
    this.uniforms = {
      srbfProbeLight: { value: this.target.texture },
      srbfProbePlaces: { value: places },
      srbfProbeNearness: { value: nearness },
      srbfProbeGrid: { value: gridOf(probes) },
      srbfProbeCounts: { value: [x, y, z] },
      srbfProbesFromScene: { value: new Matrix4() },
    };
  }

  draw(renderer: WebGLRenderer): void {
    undisturbed(renderer, () => this.pass.draw(renderer, this.target));
  }

  dispose(): void {
    for (const one of [this.target, this.pass, this.textures.places, this.textures.nearness]) one.dispose();
  }
}
