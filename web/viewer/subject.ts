/** The assets that the page can switch between, each loaded when it is first chosen; and the direct light of indirect ones. */
import type { Texture, WebGLRenderer } from "three";
import type { Asset, FloatImage, Light, Triple } from "../src";
import { alphaTexture } from "../src/three/textures";
import { DirectLight } from "./direct_light";
import { type AssetFacts, type Facts, type LoadedAsset, loadOne } from "./loading";
import { lineOf, say } from "./messages";
import { ViewerRelighting } from "./relighting";
import type { State } from "./state";

/** One asset, relit. */
export class Subject {
  readonly facts: AssetFacts;
  readonly asset: Asset;
  readonly coverage?: FloatImage;
  /** The picture's alpha: a view's coverage, 1 everywhere for other assets. */
  readonly alpha: Texture;
  readonly relighting: ViewerRelighting;
  private readonly direct?: DirectLight;

  constructor(loaded: LoadedAsset, renderer: WebGLRenderer) {
    this.facts = loaded.facts;
    this.asset = loaded.asset;
    this.coverage = loaded.coverage;
    const floats = renderer.extensions.has("OES_texture_float_linear") && renderer.extensions.has("EXT_color_buffer_float");
    this.relighting = new ViewerRelighting(loaded.asset, { source: "lightmap", target: floats ? "float" : "half", filter: "linear", weights: floats && loaded.asset.tables.surfels ? "gpu" : "cpu" });
    this.alpha = this.relighting.textures.alpha ?? alphaTexture({ kind: "float", width: 1, height: 1, channels: 1, data: new Float32Array([1]) });
    if (!loaded.direct) return;
    try {
      this.direct = new DirectLight(loaded.asset, loaded.direct, renderer);
    } catch (error) {
      say(lineOf(error), "hint");
    }
  }

  /** Whether its direct light can be added. */
  get hasDirect(): boolean {
    return this.direct !== undefined;
  }

  get lightmap(): Texture {
    return this.relighting.lightmap as Texture;
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

  /** Draw the lightmap under `lights`. */
  relight(lights: readonly Light[], terms: State["terms"], renderer: WebGLRenderer): void {
    this.relighting.set(lights);
    const wanted = this.direct && terms !== "indirect" ? this.direct.draw(lights) : undefined;
    this.relighting.add(wanted, terms === "direct" && wanted !== undefined);
    this.relighting.update(renderer);
  }
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
