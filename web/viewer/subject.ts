/** The assets that the page can switch between, each loaded when it is first chosen; and the direct light of indirect ones. */
import type { Texture, WebGLRenderer } from "three";
import type { Asset, FloatImage, Light, Triple } from "../src";
import { carried } from "../src/matrix";
import { alphaTexture } from "../src/three/textures";
import type { BallState } from "./ball_state";
import { DirectLight } from "./direct_light";
import { type AssetFacts, type Facts, type LoadedAsset, loadOne } from "./loading";
import { FineLightmap, finenessOf } from "./fine_lightmap";
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
  private readonly fine?: { direct: DirectLight; lightmap: FineLightmap };
  private isFine = false;

  constructor(loaded: LoadedAsset, renderer: WebGLRenderer) {
    this.facts = loaded.facts;
    this.asset = loaded.asset;
    this.coverage = loaded.coverage;
    const floats = drawsFloats(renderer);
    this.relighting = new ViewerRelighting(loaded.asset, { source: "lightmap", target: floats ? "float" : "half", filter: "linear", weights: weightsFor(loaded.asset, renderer) });
    this.alpha = this.relighting.textures.alpha ?? alphaTexture({ kind: "float", width: 1, height: 1, channels: 1, data: new Float32Array([1]) });
    if (!loaded.direct) return;
    try {
      this.direct = DirectLight.ofAsset(loaded.asset, loaded.direct, renderer);
      const factor = finenessOf(loaded.asset);
      const { width, height } = loaded.asset.manifest;
      if (factor > 1) this.fine = { direct: DirectLight.ofAsset(loaded.asset, loaded.direct, renderer, factor), lightmap: new FineLightmap(factor * width, factor * height, floats) };
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

  /** What a mesh shows: the lightmap, or one with finer direct light. */
  get shown(): Texture {
    return this.isFine && this.fine ? this.fine.lightmap.texture : this.lightmap;
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

  /** Draw the lightmap under `lights`, with the direct shadow of a sphere; `onMesh`: with finer direct light, in `shown`. */
  relight(lights: readonly Light[], terms: State["terms"], renderer: WebGLRenderer, ball?: BallState, onMesh = false): void {
    this.relighting.set(lights);
    const wanted = this.direct !== undefined && terms !== "indirect";
    this.isFine = onMesh && wanted && this.fine !== undefined;
    const source = this.isFine ? this.fine?.direct : this.direct;
    source?.setBall(ball && { position: carried(this.asset.assetFromWorld, ball.position), size: ball.size });
    const direct = wanted ? source?.draw(lights) : undefined;
    const alone = terms === "direct" && direct !== undefined;
    if (this.isFine) this.relighting.add();
    else this.relighting.add(direct, alone);
    this.relighting.update(renderer);
    if (this.isFine && this.fine && direct) this.fine.lightmap.draw(renderer, this.lightmap, direct, alone);
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
