/** Direct light on an indirect asset by shadow maps, with the shader pack's stages; environments and named lights add none. */
import { Color, type DataTexture, FloatType, type Object3D, RGBAFormat, type Texture, type WebGLRenderer, type WebGLRenderTarget } from "three";
import { type Asset, type FloatImage, type Light, moved, SrbfError } from "../src";
import { type DirectReceivers, directReceivers } from "./direct_points";
import { PointShadows } from "./point_shadows";
import { shadowCasters } from "./shadow_casters";
import { clear, floatTexture, type LitTexels, renderTarget } from "./shadow_maps";
import { SunShadows } from "./sun_shadows";

/** What direct light needs besides the maps: images of the asset, and the scene that casts shadows. */
export interface DirectInputs {
  normal: FloatImage;
  coverage?: FloatImage;
  /** Of radiance assets. */
  albedo?: FloatImage;
  scene: Object3D;
}

export class DirectLight {
  private readonly receivers: DirectReceivers;
  private readonly lit: LitTexels;
  private readonly sum: WebGLRenderTarget;
  private readonly suns: () => SunShadows;
  private readonly points: () => PointShadows;
  private drawn = "";

  /** @throws SrbfError where the GPU cannot blend floats. */
  constructor(
    private readonly asset: Asset,
    inputs: DirectInputs,
    private readonly renderer: WebGLRenderer,
  ) {
    if (!renderer.extensions.has("EXT_color_buffer_float") || !renderer.extensions.has("EXT_float_blend")) {
      throw new SrbfError("expected a GPU that blends floats for direct light, found one without: only the indirect light is shown");
    }
    const { width, height, direct } = asset.manifest;
    this.receivers = directReceivers(asset, asset.position as FloatImage, inputs.normal, inputs.coverage, direct?.footprint ?? 1);
    const texture = (data: Float32Array): DataTexture => floatTexture(data, width, height);
    const corners = this.receivers.corners.map(({ points, normals }) => ({ points: texture(points), normals: texture(normals) }));
    this.lit = { corners, reflectance: texture(reflectance(asset, inputs.albedo)) };
    this.sum = renderTarget(width, height, RGBAFormat, FloatType);
    const { bounds, center } = this.receivers;
    const casters = shadowCasters(inputs.scene, center);
    this.suns = once(() => new SunShadows(renderer, this.lit, casters, bounds, direct?.sun_angle ?? 0));
    this.points = once(() => new PointShadows(renderer, this.lit, casters, center));
  }

  /** The direct light of `lights`, in the asset's quantity, redrawn where they have changed. */
  draw(lights: readonly Light[]): Texture {
    const shining = lights.filter((light) => light.kind !== "environment" && light.kind !== "named");
    const state = JSON.stringify(shining);
    if (state === this.drawn) return this.sum.texture;
    this.drawn = state;
    const { renderer } = this;
    const kept = { color: renderer.getClearColor(new Color()), alpha: renderer.getClearAlpha(), autoClear: renderer.autoClear };
    renderer.autoClear = false;
    clear(renderer, this.sum, 0);
    for (const light of shining) {
      const own = moved(light, this.asset.assetFromWorld);
      if (own.kind === "directional") this.suns().add(this.sum, own);
      else this.points().add(this.sum, own);
    }
    renderer.setRenderTarget(null);
    renderer.setClearColor(kept.color, kept.alpha);
    renderer.autoClear = kept.autoClear;
    return this.sum.texture;
  }
}

/** 1, or albedo / pi, RGBA. */
function reflectance(asset: Asset, albedo: FloatImage | undefined): Float32Array {
  const { width, height, quantity } = asset.manifest;
  const out = new Float32Array(4 * width * height).fill(1);
  if (quantity === "irradiance" || !albedo) return out;
  for (let i = 0; i < width * height; ++i) for (let c = 0; c < 3; ++c) out[4 * i + c] = albedo.data[albedo.channels * i + c] / Math.PI;
  return out;
}

function once<T>(make: () => T): () => T {
  let made: T | undefined;
  return () => (made ??= make());
}
