/** The assets that the page can switch between, each loaded when it is first chosen; and the direct light of indirect ones. */
import type { Mesh, Texture, WebGLRenderer } from "three";
import { type Asset, type FloatImage, type Light, type Profile, receiverKind, type Triple } from "../src";
import { carried } from "../src/matrix";
import { alphaTexture } from "../src/three/textures";
import type { BallState } from "./ball_state";
import { checkBlending, type DirectInputs, DirectLight } from "./direct_light";
import { type AssetFacts, type Facts, type LoadedAsset, loadOne } from "./loading";
import { FineLightmap, finenessOf } from "./fine_lightmap";
import { lineOf, say } from "./messages";
import { PixelLight } from "./pixel_light";
import { ViewerRelighting } from "./relighting";
import type { State } from "./state";

/** Where the light is shown: on the texels, on a mesh, or on a mesh whose pixels have direct light of their own. */
export type Place = "texels" | "mesh" | "pixels";

/** One asset, relit. */
export class Subject {
  readonly facts: AssetFacts;
  readonly asset: Asset;
  readonly coverage?: FloatImage;
  /** Of its scene's own lights, and of `--profile`, by the names that they have for them. */
  readonly profiles: ReadonlyMap<string, Profile>;
  /** The picture's alpha: a view's coverage, 1 everywhere for other assets. */
  readonly alpha: Texture;
  readonly relighting: ViewerRelighting;
  private readonly directInputs?: DirectInputs;
  private readonly directs = new Map<number, DirectLight>(); // by resolution over the lightmap's, made when first shown
  private readonly fineness: number;
  private fine?: FineLightmap;
  private pixels?: PixelLight;
  private isFine = false;
  /** For what it was last relit. */
  place: Place = "texels";

  constructor(loaded: LoadedAsset, renderer: WebGLRenderer) {
    this.facts = loaded.facts;
    this.asset = loaded.asset;
    this.coverage = loaded.coverage;
    this.profiles = loaded.profiles;
    const floats = drawsFloats(renderer);
    this.relighting = new ViewerRelighting(loaded.asset, { source: "lightmap", target: floats ? "float" : "half", filter: "linear", weights: weightsFor(loaded.asset, renderer) });
    this.alpha = this.relighting.textures.alpha ?? alphaTexture({ kind: "float", width: 1, height: 1, channels: 1, data: new Float32Array([1]) });
    this.fineness = finenessOf(loaded.asset);
    if (!loaded.direct) return;
    try {
      checkBlending(renderer);
      this.directInputs = loaded.direct;
    } catch (error) {
      say(lineOf(error), "hint");
    }
  }

  /** How wide the discs of suns are that do not say it themselves, degrees. */
  get sunAngle(): number {
    return ((this.asset.manifest.direct?.sun_angle ?? 0) * 180) / Math.PI;
  }

  /** Whether its direct light can be added. */
  get hasDirect(): boolean {
    return this.directInputs !== undefined;
  }

  get lightmap(): Texture {
    return this.relighting.lightmap as Texture;
  }

  /** What is shown: the lightmap, or on a mesh one with finer direct light. */
  get shown(): Texture {
    return this.isFine && this.fine ? this.fine.texture : this.lightmap;
  }

  /** How many coefficient maps there are to look at. */
  get maps(): number {
    return this.asset.tables.maps;
  }

  /** Centers of its light functions within the captured domain. */
  get centers(): readonly Triple[] {
    const { tables, manifest } = this.asset;
    return tables.centers.filter((direction) => manifest.domain === "sphere" || direction[2] > 0); // some light functions lie past the horizon
  }

  /** Draw the lightmap under `lights`, with the direct shadow of a sphere. On a mesh direct light is finer, in `shown`; at its pixels it is apart. */
  relight(lights: readonly Light[], terms: State["terms"], renderer: WebGLRenderer, ball?: BallState, place: Place = "texels"): void {
    this.relighting.set(lights);
    this.place = place;
    const source = terms === "indirect" || place === "pixels" ? undefined : this.directAt(place === "mesh" ? this.fineness : 1, renderer);
    source?.setBall(ball && { position: carried(this.asset.assetFromWorld, ball.position), size: ball.size });
    const direct = source?.draw(lights);
    const alone = terms === "direct" && direct !== undefined;
    this.isFine = place === "mesh" && direct !== undefined && this.fineness > 1;
    this.relighting.add(this.isFine ? undefined : direct, alone && !this.isFine);
    this.relighting.update(renderer);
    if (this.isFine && direct) this.drawFine(renderer, direct, alone);
  }

  /** Whether direct light can be that of the pixels of a mesh: that of lightmaps. */
  get hasPixels(): boolean {
    return this.hasDirect && receiverKind(this.asset.manifest) === "lightmap";
  }

  /** The direct light of the pixels of `meshes`, with the shadow of a sphere. */
  pixelLight(meshes: readonly Mesh[], renderer: WebGLRenderer, ball?: BallState): PixelLight {
    this.pixels ??= new PixelLight(this.asset, this.directInputs as DirectInputs, meshes, renderer);
    this.pixels.setBall(ball);
    return this.pixels;
  }

  /** Give the memory of pixels back while another asset is shown. */
  restPixels(): void {
    this.pixels?.rest();
  }

  /** Direct light at so many times the lightmap's resolution; undefined where there is none. */
  private directAt(factor: number, renderer: WebGLRenderer): DirectLight | undefined {
    if (!this.directInputs) return undefined;
    const found = this.directs.get(factor) ?? DirectLight.ofAsset(this.asset, this.directInputs, renderer, factor);
    this.directs.set(factor, found);
    return found;
  }

  private drawFine(renderer: WebGLRenderer, direct: Texture, alone: boolean): void {
    const { width, height } = this.asset.manifest;
    this.fine ??= new FineLightmap(this.fineness * width, this.fineness * height, drawsFloats(renderer));
    this.fine.draw(renderer, this.lightmap, direct, alone);
  }
}

/** Where an asset's weights are computed. */
export function weightsFor({ tables }: Asset, renderer: WebGLRenderer): "gpu" | "cpu" {
  return drawsFloats(renderer) && (tables.surfels || tables.gather) ? "gpu" : "cpu";
}

function drawsFloats({ extensions }: WebGLRenderer): boolean {
  return extensions.has("OES_texture_float_linear") && extensions.has("EXT_color_buffer_float");
}

/** Loads each asset when it is first chosen. */
export class Subjects {
  private readonly loading = new Map<number, Promise<Subject>>();

  constructor(
    private readonly facts: Facts,
    private readonly renderer: WebGLRenderer,
    index: number,
    first: LoadedAsset,
  ) {
    this.loading.set(index, Promise.resolve(new Subject(first, renderer)));
  }

  /** @throws SrbfError in one line where it cannot be read. */
  get(index: number): Promise<Subject> {
    let subject = this.loading.get(index);
    if (!subject) {
      subject = loadOne(this.facts.assets[index], () => undefined).then((loaded) => new Subject(loaded, this.renderer));
      subject.catch(() => this.loading.delete(index));
      this.loading.set(index, subject);
    }
    return subject;
  }
}
