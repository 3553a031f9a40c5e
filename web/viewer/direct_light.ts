/** Direct light on an indirect asset by shadow maps, with the shader pack's stages; environments and named lights add none. */
import { Color, type DataTexture, FloatType, type Object3D, RGBAFormat, SphereGeometry, type Texture, type WebGLRenderer, type WebGLRenderTarget } from "three";
import { type Asset, type FloatImage, type Light, moved, SrbfError, type Triple } from "../src";
import { type DirectReceivers, directReceivers, fineReceivers } from "./direct_points";
import { LinkedPixels } from "./linked_pixels";
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
  /** Of views with gloss: whole albedo of the lobes, their roughness and share with a Fresnel term, the pack's table of lobes, and the camera. */
  gloss?: { glossy: FloatImage; lobe: FloatImage; table: FloatImage; camera: ViewCamera };
  /** What pixels of a view let through. */
  through?: FloatImage;
  scene: Object3D;
}

/** The camera of the bake, as asset.json has it under `direct`: rows of its matrix. */
export interface ViewCamera {
  type: string;
  matrix_world: number[][];
}

/** Where light is added: the size of its picture, and what a texel makes of irradiance, RGBA. */
interface Surface {
  width: number;
  height: number;
  reflectance: Float32Array;
  /** What it makes of irradiance on its back. */
  through?: Float32Array;
  gloss?: DirectInputs["gloss"];
}

const [SIDES, RINGS] = [32, 16]; // of a ball that casts shadows

export class DirectLight {
  private readonly ball = new SphereGeometry(1, SIDES, RINGS);
  private readonly sum: WebGLRenderTarget;
  private readonly suns: () => SunShadows;
  private readonly points: () => PointShadows;
  private drawn = "";
  private cast = "";

  /** On the asset's texels, or on a grid that is `factor` times finer in both directions. @throws SrbfError where the GPU cannot blend floats. */
  static ofAsset(asset: Asset, inputs: DirectInputs, renderer: WebGLRenderer, factor = 1): DirectLight {
    const { width, height, direct } = asset.manifest;
    const { normal, coverage, scene } = inputs;
    const position = asset.position as FloatImage;
    const receivers = factor > 1 ? fineReceivers(asset, position, normal, coverage, factor) : directReceivers(asset, position, normal, coverage, direct?.footprint ?? 1);
    const surface = { width: factor * width, height: factor * height, reflectance: reflectanceOf(asset, inputs.albedo, factor) };
    const further = factor > 1 ? {} : { gloss: inputs.gloss, through: inputs.through && reflectanceOf(asset, inputs.through, 1) };
    const lit = litTexels(receivers, { ...surface, ...further });
    return new DirectLight(asset, receivers, lit, surface, scene, renderer, factor > 1 ? undefined : new LinkedPixels(scene, position, coverage, receivers.center));
  }

  /** On pixels of which textures hold points and normals, in the frame of `asset`, points less `center`, and reflectance; of any size, see `resize`. */
  static ofPixels(asset: Asset, { normal, coverage, scene }: DirectInputs, pixels: { points: Texture; normals: Texture; reflectance: Texture }, renderer: WebGLRenderer): DirectLight {
    const { center, bounds } = directReceivers(asset, asset.position as FloatImage, normal, coverage, 1);
    const lit = [{ corners: [pixels], reflectance: pixels.reflectance }];
    return new DirectLight(asset, { center, bounds, corners: [] }, lit, { width: 1, height: 1 }, scene, renderer);
  }

  /** Of `width` x `height` white points that move, in the frame of `asset`: put them somewhere first. @throws as `ofAsset`. */
  static ofPoints(asset: Asset, width: number, height: number, scene: Object3D, renderer: WebGLRenderer): DirectLight {
    const [points, normals] = [0, 1].map(() => new Float32Array(4 * width * height));
    const receivers = { center: [0, 0, 0] as [number, number, number], corners: [{ points, normals }], bounds: new Float32Array(3 * width * height) };
    const lit = litTexels(receivers, { width, height, reflectance: new Float32Array(4 * width * height).fill(1) });
    return new DirectLight(asset, receivers, lit, { width, height }, scene, renderer);
  }

  private constructor(
    private readonly asset: Asset,
    private readonly receivers: DirectReceivers,
    private readonly lit: readonly LitTexels[],
    { width, height }: { width: number; height: number },
    scene: Object3D,
    private readonly renderer: WebGLRenderer,
    private readonly linked?: LinkedPixels,
  ) {
    checkBlending(renderer);
    this.sum = renderTarget(width, height, RGBAFormat, FloatType);
    const { bounds, center } = this.receivers;
    this.ball.setAttribute("corner", this.ball.getAttribute("position").clone());
    this.ball.setAttribute("cornerNormal", this.ball.getAttribute("position"));
    this.ball.setDrawRange(0, 0);
    const casters = [...shadowCasters(scene, center), { geometry: this.ball }];
    this.suns = once(() => new SunShadows(renderer, this.lit, casters, bounds, asset.manifest.direct?.sun_angle ?? 0));
    this.points = once(() => new PointShadows(renderer, this.lit, casters, center));
  }

  /** Origin of the points, meters, in the asset's frame. */
  get center(): Triple {
    return this.receivers.center;
  }

  /** The pixels of `ofPixels` have changed: how many there are now. */
  resize(width: number, height: number): void {
    this.sum.setSize(width, height);
    this.drawn = "";
  }

  /** Put the points of `ofPoints` there, in the asset's frame. */
  move(points: readonly Triple[], normals: readonly Triple[]): void {
    const [own] = this.receivers.corners;
    const [textures] = this.lit[0].corners;
    points.forEach((point, i) => {
      own.points.set(point, 4 * i);
      own.normals.set(normals[i], 4 * i);
      this.receivers.bounds.set(point, 3 * i);
    });
    textures.points.needsUpdate = textures.normals.needsUpdate = true;
    this.drawn = "";
  }

  /** Let a ball in the asset's frame cast shadows, or none. */
  setBall(ball?: { position: Triple; size: number }): void {
    const state = JSON.stringify(ball);
    if (state === this.cast) return;
    this.cast = state;
    this.drawn = "";
    this.ball.setDrawRange(0, ball ? Infinity : 0);
    if (!ball) return;
    const [unit, corner] = [this.ball.getAttribute("position"), this.ball.getAttribute("corner")];
    for (let i = 0; i < unit.count; ++i) {
      for (let k = 0; k < 3; ++k) corner.setComponent(i, k, ball.position[k] - this.receivers.center[k] + ball.size * unit.getComponent(i, k));
    }
    corner.needsUpdate = true;
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
      const choice = this.linked?.choice(own) ?? {};
      if (own.kind === "directional") this.suns().add(this.sum, own, choice);
      else this.points().add(this.sum, own, choice);
    }
    renderer.setRenderTarget(null);
    renderer.setClearColor(kept.color, kept.alpha);
    renderer.autoClear = kept.autoClear;
    return this.sum.texture;
  }
}

/** @throws SrbfError where the GPU cannot blend floats, which direct light needs. */
export function checkBlending({ extensions }: WebGLRenderer): void {
  if (extensions.has("EXT_color_buffer_float") && extensions.has("EXT_float_blend")) return;
  throw new SrbfError("expected a GPU that blends floats for direct light, found one without: only the indirect light is shown");
}

/** 1, or albedo / pi, RGBA, on a grid that is `factor` times finer in both directions. */
export function reflectanceOf(asset: Asset, albedo: FloatImage | undefined, factor: number): Float32Array {
  const { width, height, quantity } = asset.manifest;
  const [across, down] = [factor * width, factor * height];
  const out = new Float32Array(4 * across * down).fill(1);
  if (quantity === "irradiance" || !albedo) return out;
  for (let row = 0, at = 0; row < down; ++row) {
    for (let column = 0; column < across; ++column, at += 4) {
      const i = Math.floor(row / factor) * width + Math.floor(column / factor);
      for (let c = 0; c < 3; ++c) out[at + c] = albedo.data[albedo.channels * i + c] / Math.PI;
    }
  }
  return out;
}

/** What lobes reflect, as uniforms of the pack's stages. */
function lobesOf({ glossy, lobe, table, camera }: NonNullable<DirectInputs["gloss"]>, center: Triple): LitTexels["lobes"] {
  const { type, matrix_world: rows } = camera;
  const eye = type === "PERSP" ? [...rows.slice(0, 3).map((row, i) => row[3] - center[i]), 1] : [...rows.slice(0, 3).map((row) => row[2]), 0];
  const texture = ({ data, width, height }: FloatImage) => floatTexture(data, width, height);
  return { glossy: texture(glossy), lobes: texture(lobe), lobeAlbedo: texture(table), eye };
}

function litTexels(receivers: DirectReceivers, { width, height, reflectance, gloss, through }: Surface): LitTexels[] {
  const texture = (data: Float32Array): DataTexture => floatTexture(data, width, height);
  const corners = receivers.corners.map(({ points, normals }) => ({ points: texture(points), normals: texture(normals) }));
  const front = { corners, reflectance: texture(reflectance), lobes: gloss && lobesOf(gloss, receivers.center) };
  return [front, ...(through ? [behind(front, receivers, through, texture)] : [])];
}

/** The same texels lit from behind, of what they let through. */
function behind({ corners }: LitTexels, receivers: DirectReceivers, through: Float32Array, texture: (data: Float32Array) => DataTexture): LitTexels {
  const turned = receivers.corners.map(({ normals }) => texture(normals.map((x) => -x)));
  return { corners: corners.map(({ points }, i) => ({ points, normals: turned[i] })), reflectance: texture(through) };
}

function once<T>(make: () => T): () => T {
  let made: T | undefined;
  return () => (made ??= make());
}
