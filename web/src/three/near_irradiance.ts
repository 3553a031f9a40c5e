/**
 * Light from the brightest surfels of a pool on the others and on the view's clusters: a shadow cube about each group of them, and a pass for
 * each set of receivers. Direct light on the surfels is read back, since which of them are bright is found on the CPU.
 */
import type { DataTexture, Texture, WebGLRenderer, WebGLRenderTarget } from "three";
import { ACROSS, type Gather } from "../gather";
import type { Triple } from "../matrix";
import { MOST, type NearPool, type NearSources, without } from "../near_sources";
import type { Look, PackedCells } from "../surfels";
import { floatTarget, floatTexture } from "./float_textures";
import type { FullscreenPass } from "./fullscreen";
import { irradiancePass, type SurfelIrradiance } from "./surfel_irradiance";

const NEAREST = 5e-4; // meters: a group is seen from close above its surface, which hides what is behind

interface Receivers {
  readonly pass: FullscreenPass;
  readonly sums: [WebGLRenderTarget, WebGLRenderTarget];
}

/** Irradiance of a light that has bright surfels: one texel for each surfel, or view cluster. */
export interface Parted {
  /** On surfels, without its part on the bright ones. */
  readonly far: Texture;
  /** The same, and what the bright ones lay on the others. */
  readonly second: Texture;
  /** What they lay on view clusters. */
  readonly clusters: Texture;
  /** What the bright ones reflect toward lobes, of the part of their irradiance that links lack. */
  readonly taken?: Texture;
}

export class NearIrradiance {
  private readonly far: DataTexture;
  private readonly taken?: DataTexture;
  private readonly sources: DataTexture;
  private readonly textures: DataTexture[];
  private readonly surfels: Receivers;
  private readonly clusters: Receivers;
  private readonly read: Float32Array;

  /** `cells`: of the pool, as `direct` has them, in the pool's order: each is its own patch. */
  constructor(
    private readonly gather: Gather,
    private readonly pool: NearPool,
    private readonly cells: PackedCells,
    private readonly direct: SurfelIrradiance,
  ) {
    const { width, height } = cells;
    this.read = new Float32Array(4 * width * height);
    this.far = floatTexture(new Float32Array(4 * width * height), width, height);
    if (gather.gloss) this.taken = floatTexture(new Float32Array(4 * width * height), width, height);
    this.sources = floatTexture(new Float32Array(12 * MOST), MOST, 3);
    const rows = Math.ceil(pool.clusters / ACROSS);
    this.textures = [pool.places, pool.normals].map((values, row) => {
      const texels = new Float32Array(4 * ACROSS * rows);
      for (let i = 0; i < 3 * pool.clusters; ++i) texels[4 * Math.floor(i / 3) + (i % 3)] = values[i] - (row === 0 ? cells.middle[i % 3] : 0);
      return floatTexture(texels, ACROSS, rows);
    });
    this.surfels = this.receivers(direct.places, direct.normals, width, height);
    this.clusters = this.receivers(this.textures[0], this.textures[1], ACROSS, rows);
  }

  /** Of a light's irradiance on the surfels; undefined where none is bright. Within `undisturbed`. */
  draw(renderer: WebGLRenderer, irradiance: WebGLRenderTarget, looks: readonly Look[]): Parted | undefined {
    const { cells, pool, read } = this;
    renderer.readRenderTargetPixels(irradiance, 0, 0, cells.width, cells.height, read);
    const values = new Float64Array(3 * pool.cells.count);
    for (let i = 0; i < pool.cells.count; ++i) for (let c = 0; c < 3; ++c) values[3 * i + c] = read[4 * i + c];
    const near = pool.sources(values, looks[0].factor ? "above" : { place: this.placeOf(looks), distant: looks[0].distant });
    if (!near) return undefined;
    const far = this.far.image.data as unknown as Float32Array;
    const toLobes = this.taken?.image.data as unknown as Float32Array | undefined;
    const { albedo, specular } = this.gather;
    without(near, values).forEach((x, i) => {
      const at = 4 * Math.floor(i / 3) + (i % 3);
      far[at] = x;
      if (toLobes) toLobes[at] = (albedo[i] + (specular?.[i] ?? 0)) * (values[i] - x);
    });
    this.far.needsUpdate = true;
    if (this.taken) this.taken.needsUpdate = true;
    this.setSources(near);
    const [blank] = this.clusters.sums;
    renderer.setRenderTarget(blank);
    renderer.setClearColor(0, 0);
    renderer.clear(true, false, false);
    let [second, clusters]: Texture[] = [this.far, blank.texture];
    for (const { first, count, place } of near.groups) {
      const light = place.map((x, k) => x - cells.middle[k]) as unknown as Triple;
      const { nearness } = this.direct.maps.draw(renderer, light, false, NEAREST);
      const values = { nearness, light, first, count };
      second = added(renderer, this.surfels, second, values);
      clusters = added(renderer, this.clusters, clusters, values);
    }
    return { far: this.far, second, clusters, taken: this.taken };
  }

  dispose(): void {
    const sets = [this.surfels, this.clusters].flatMap(({ pass, sums }) => [pass, ...sums]);
    this.taken?.dispose();
    for (const one of [this.far, this.sources, ...this.textures, ...sets]) one.dispose();
  }

  /** The middle of a light's looks, or its direction. */
  private placeOf(looks: readonly Look[]): Triple {
    if (looks[0].distant) return looks[0].place;
    return this.cells.middle.map((x, k) => x + looks.reduce((sum, { place }) => sum + place[k], 0) / looks.length) as unknown as Triple;
  }

  private setSources({ surfels, light }: NearSources): void {
    const { cells } = this.pool;
    const texels = this.sources.image.data as unknown as Float32Array;
    surfels.forEach((surfel, i) => {
      for (let k = 0; k < 3; ++k) {
        texels[4 * i + k] = cells.places[3 * surfel + k] - this.cells.middle[k];
        texels[4 * (MOST + i) + k] = cells.normals[3 * surfel + k];
        texels[4 * (2 * MOST + i) + k] = light[3 * i + k];
      }
      texels[4 * i + 3] = cells.areas[surfel];
    });
    this.sources.needsUpdate = true;
  }

  private receivers(places: Texture, normals: Texture, width: number, height: number): Receivers {
    const set = { places: { value: places }, normals: { value: normals }, sources: { value: this.sources }, lift: { value: this.pool.lift } };
    const drawn = { former: { value: null }, light: { value: null }, nearness: { value: null }, first: { value: 0 }, count: { value: 0 } };
    const defines = { SRBF_SHADOW: 1, SRBF_MEAN_NORMALS: 1, SRBF_SOURCES: 1 };
    return { pass: irradiancePass({ ...set, ...drawn }, defines), sums: [floatTarget(width, height), floatTarget(width, height)] };
  }
}

/** The sum of `former` and what one group of sources lays on receivers. */
function added(renderer: WebGLRenderer, { pass, sums }: Receivers, former: Texture, values: Record<string, unknown>): Texture {
  const next = sums.find(({ texture }) => texture !== former) as WebGLRenderTarget;
  for (const [name, value] of Object.entries({ former, ...values })) pass.uniforms[name].value = value;
  pass.draw(renderer, next);
  return next.texture;
}
