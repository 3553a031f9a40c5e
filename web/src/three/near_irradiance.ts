/**
 * Light from the brightest surfels of a pool on the others and on the view's clusters. What these see of a cell is drawn once, by a shadow cube
 * about it, and kept. Direct light on the surfels is read back, since which of them are bright is found on the CPU.
 */
import { type DataTexture, NearestFilter, RedFormat, type Texture, UnsignedByteType, type WebGLRenderer, WebGLRenderTarget } from "three";
import { ACROSS, type Gather } from "../gather";
import type { Triple } from "../matrix";
import { NearSlots } from "../near_slots";
import { ENTRIES, type NearPool, type SendingCell, without } from "../near_sources";
import nearLight from "../shaders/near_light.glsl";
import nearSeen from "../shaders/near_seen.glsl";
import type { Look, PackedCells } from "../surfels";
import { floatTarget, floatTexture } from "./float_textures";
import { FullscreenPass, within } from "./fullscreen";
import { clusterTextures } from "./pool_textures";
import type { SurfelIrradiance } from "./surfel_irradiance";

const NEAREST = 5e-4; // meters: a cell is seen from close above its surface, which hides what is behind
const SLOTS = 64; // cells whose visibility is kept, at most

interface Receivers {
  readonly rows: number;
  readonly seeing: FullscreenPass;
  readonly lighting: FullscreenPass;
  /** How much each sees of the cells, one slot below the other. */
  readonly seen: WebGLRenderTarget;
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
  private sets?: [surfels: Receivers, clusters: Receivers];
  private slots = new NearSlots(SLOTS);
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
    this.sources = floatTexture(new Float32Array(12 * ENTRIES), ENTRIES, 3);
    this.textures = clusterTextures(pool, cells.middle);
  }

  /** Of a light's irradiance on the surfels; undefined where none is bright. Within `undisturbed`. */
  draw(renderer: WebGLRenderer, irradiance: WebGLRenderTarget, looks: readonly Look[]): Parted | undefined {
    const { cells, pool, read } = this;
    renderer.readRenderTargetPixels(irradiance, 0, 0, cells.width, cells.height, read);
    const values = new Float64Array(3 * pool.cells.count);
    for (let i = 0; i < pool.cells.count; ++i) for (let c = 0; c < 3; ++c) values[3 * i + c] = read[4 * i + c];
    const near = pool.sources(values, looks[0].distant ? undefined : this.middleOf(looks));
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
    const [surfels, receivingClusters] = this.receivers(renderer);
    const [blank] = receivingClusters.sums;
    renderer.setRenderTarget(blank);
    renderer.setClearColor(0, 0);
    renderer.clear(true, false, false);
    let [second, clusters]: Texture[] = [this.far, blank.texture];
    for (let start = 0; start < near.cells.length; start += this.slots.count) {
      const sending = near.cells.slice(start, start + this.slots.count);
      const slots = this.slots.of(
        sending.map(({ cell }) => cell),
        (cell, slot) => this.drawSeen(renderer, cell, slot),
      );
      const count = this.setSources(near.surfels, sending, slots);
      second = added(renderer, surfels, second, count);
      clusters = added(renderer, receivingClusters, clusters, count);
    }
    return { far: this.far, second, clusters, taken: this.taken };
  }

  dispose(): void {
    const sets = (this.sets ?? []).flatMap(({ seeing, lighting, seen, sums }) => [seeing, lighting, seen, ...sums]);
    this.taken?.dispose();
    for (const one of [this.far, this.sources, ...this.textures, ...sets]) one.dispose();
  }

  /** The middle of a light's looks. */
  private middleOf(looks: readonly Look[]): Triple {
    return this.cells.middle.map((x, k) => x + looks.reduce((sum, { place }) => sum + place[k], 0) / looks.length) as unknown as Triple;
  }

  /** The surfels that cells send light from; how many. */
  private setSources(surfels: readonly number[], sending: readonly SendingCell[], slots: readonly number[]): number {
    const { cells } = this.pool;
    const texels = this.sources.image.data as unknown as Float32Array;
    let at = 0;
    sending.forEach(({ members, light }, number) => {
      members.forEach((member, i) => {
        const surfel = surfels[member];
        for (let k = 0; k < 3; ++k) {
          texels[4 * at + k] = cells.places[3 * surfel + k] - this.cells.middle[k];
          texels[4 * (ENTRIES + at) + k] = cells.normals[3 * surfel + k];
          texels[4 * (2 * ENTRIES + at) + k] = light[i][k];
        }
        texels[4 * at + 3] = cells.areas[surfel];
        texels[4 * (ENTRIES + at) + 3] = slots[number];
        ++at;
      });
    });
    this.sources.needsUpdate = true;
    return at;
  }

  /** What all receivers see of a cell. */
  private drawSeen(renderer: WebGLRenderer, cell: number, slot: number): void {
    const light = this.pool.near.place(cell).map((x, k) => x - this.cells.middle[k]) as unknown as Triple;
    const { nearness } = this.direct.maps.draw(renderer, light, false, NEAREST);
    for (const { seeing, seen, rows } of this.receivers(renderer)) {
      for (const [name, value] of Object.entries({ nearness, light, first: slot * rows })) seeing.uniforms[name].value = value;
      within(seen, slot * rows, rows, (target) => seeing.draw(renderer, target));
    }
  }

  /** Both sets, made when it is known how large textures may be. */
  private receivers(renderer: WebGLRenderer): [surfels: Receivers, clusters: Receivers] {
    if (!this.sets) {
      const { direct, cells, textures } = this;
      const rows = textures[0].image.height;
      this.slots = new NearSlots(Math.min(SLOTS, Math.floor(renderer.capabilities.maxTextureSize / Math.max(cells.height, rows))));
      this.sets = [this.set(direct.places, direct.normals, cells.width, cells.height), this.set(textures[0], textures[1], ACROSS, rows)];
    }
    return this.sets;
  }

  private set(places: Texture, normals: Texture, width: number, rows: number): Receivers {
    const kind = { format: RedFormat, type: UnsignedByteType, magFilter: NearestFilter, minFilter: NearestFilter, depthBuffer: false };
    const seen = new WebGLRenderTarget(width, rows * this.slots.count, kind);
    const own = { places: { value: places }, normals: { value: normals } };
    const looked = { nearness: { value: null }, light: { value: null }, lift: { value: this.pool.lift }, first: { value: 0 } };
    const lit = { seen: { value: seen.texture }, sources: { value: this.sources }, former: { value: null }, count: { value: 0 }, rows: { value: rows } };
    return {
      rows,
      seeing: new FullscreenPass(nearSeen, { ...own, ...looked }),
      lighting: new FullscreenPass(nearLight, { ...own, ...lit }),
      seen,
      sums: [floatTarget(width, rows), floatTarget(width, rows)],
    };
  }
}

/** The sum of `former` and what `count` sources lay on receivers. */
function added(renderer: WebGLRenderer, { lighting, sums }: Receivers, former: Texture, count: number): Texture {
  const next = sums.find(({ texture }) => texture !== former) as WebGLRenderTarget;
  for (const [name, value] of Object.entries({ former, count })) lighting.uniforms[name].value = value;
  lighting.draw(renderer, next);
  return next.texture;
}
