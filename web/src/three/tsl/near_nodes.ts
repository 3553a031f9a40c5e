/** `NearIrradiance` for WebGPURenderer: light from the brightest surfels of a pool on the others and on the view's clusters. */
import { type DataTexture, NearestFilter, RedFormat, RenderTarget, type Texture, UnsignedByteType, Vector3 } from "three";
import * as tsl from "three/tsl";
import type { Renderer } from "three/webgpu";
import { ACROSS } from "../../gather";
import { NearSlots } from "../../near_slots";
import { ENTRIES, type NearPool, type NearSources, type SendingCell } from "../../near_sources";
import type { Triple } from "../../matrix";
import type { PackedCells } from "../../surfels";
import { floatTexture } from "../float_textures";
import { clusterTextures } from "../pool_textures";
import { each } from "./inputs";
import type { IrradianceNodes } from "./irradiance_nodes";
import type { N } from "./nodes";
import { cleared, disposeOf, floatTarget, type Pass, pass, render, within } from "./passes";
import { seenAround, tangents } from "./surfel_irradiance";
import { folded } from "./table_nodes";

const { dot, float, Fn, If, int, ivec2, max, screenCoordinate, select, sqrt, texture, textureLoad, uniform, vec4 } = tsl as Record<string, N>;

const NEAREST = 5e-4; // meters: a cell is seen from close above its surface, which hides what is behind
const [SLOTS, LARGEST] = [64, 8192]; // cells whose visibility is kept, at most, and texels of a texture's side
const [CLOSE, PARTS] = [8, 4]; // sides of a surfel, closer than which to a receiver it counts as so many parts a side

interface Receivers {
  readonly rows: number;
  /** How much each sees of the cells, one slot below the other. */
  readonly seen: RenderTarget;
  readonly seeing: Pass;
  /** [from the first of the sums, from the second]. */
  readonly lighting: [Pass, Pass];
  readonly sums: [RenderTarget, RenderTarget];
  /** The one of them that holds the sum, a texture node. */
  readonly sum: N;
}

/** Textures of the surfels, and their direct irradiance, a texture node. */
export interface SurfelTextures {
  albedo: Texture;
  irradiance: N;
}

export class NearNodes {
  /** Which part of its irradiance is taken out of the links of each surfel. */
  readonly parts: DataTexture;
  private readonly sources: DataTexture;
  private readonly textures: DataTexture[];
  private readonly slots: NearSlots;
  private readonly uniforms = { light: uniform(new Vector3()), first: uniform(0, "int"), count: uniform(0, "int") } as Record<string, N>;
  private readonly onSurfels: Receivers;
  private readonly onClusters: Receivers;

  /** `cells`: of the pool, as `direct` has them, in the pool's order: each is its own patch. */
  constructor(
    private readonly pool: NearPool,
    private readonly cells: PackedCells,
    private readonly direct: IrradianceNodes,
    private readonly own: SurfelTextures,
  ) {
    const { width, height } = cells;
    this.parts = floatTexture(new Float32Array(4 * width * height), width, height);
    this.sources = floatTexture(new Float32Array(4 * ENTRIES), ENTRIES, 1);
    const rows = Math.ceil(pool.clusters / ACROSS);
    this.textures = clusterTextures(pool, cells.middle);
    this.slots = new NearSlots(Math.min(SLOTS, Math.floor(LARGEST / Math.max(height, rows))));
    this.onSurfels = this.receivers(direct.places, direct.normals, width, height);
    this.onClusters = this.receivers(this.textures[0], this.textures[1], ACROSS, rows);
  }

  /** What bright surfels lay on the others, and on view clusters: texture nodes. */
  get sums(): { surfels: N; clusters: N } {
    return { surfels: this.onSurfels.sum, clusters: this.onClusters.sum };
  }

  /** Light from these surfels, or from none. */
  draw(renderer: Renderer, near: NearSources | undefined): void {
    const parts = this.parts.image.data as Float32Array;
    parts.fill(0);
    near?.surfels.forEach((surfel, i) => (parts[4 * surfel] = near.parts[i]));
    this.parts.needsUpdate = true;
    for (const { sums, sum } of [this.onSurfels, this.onClusters]) {
      cleared(renderer, sums[0]);
      sum.value = sums[0].texture;
    }
    if (!near) return;
    let from: 0 | 1 = 0;
    for (let start = 0; start < near.cells.length; start += this.slots.count) {
      const sending = near.cells.slice(start, start + this.slots.count);
      const slots = this.slots.of(
        sending.map(({ cell }) => cell),
        (cell, slot) => this.drawSeen(renderer, cell, slot),
      );
      this.uniforms.count.value = this.setSources(near.surfels, sending, slots);
      for (const { lighting } of [this.onSurfels, this.onClusters]) render(renderer, lighting[from]);
      from = from === 0 ? 1 : 0;
    }
    for (const { sums, sum } of [this.onSurfels, this.onClusters]) sum.value = sums[from].texture;
  }

  dispose(): void {
    for (const { seen, seeing, lighting, sums } of [this.onSurfels, this.onClusters]) {
      disposeOf([seeing, ...lighting]);
      for (const one of [seen, ...sums]) one.dispose();
    }
    for (const one of [this.parts, this.sources, ...this.textures]) one.dispose();
  }

  /** The surfels that cells send light from; how many. */
  private setSources(surfels: readonly number[], sending: readonly SendingCell[], slots: readonly number[]): number {
    const texels = this.sources.image.data as Float32Array;
    let at = 0;
    sending.forEach(({ members, shares }, number) => {
      members.forEach((member, i) => texels.set([surfels[member], slots[number], shares[i]], 4 * at++));
    });
    this.sources.needsUpdate = true;
    return at;
  }

  /** What all receivers see of a cell. */
  private drawSeen(renderer: Renderer, cell: number, slot: number): void {
    const light = this.pool.near.place(cell).map((x, k) => x - this.cells.middle[k]) as unknown as Triple;
    this.direct.occluders.drawNear(renderer, light, NEAREST);
    this.uniforms.light.value.set(...light);
    for (const { seeing, seen, rows } of [this.onSurfels, this.onClusters]) {
      this.uniforms.first.value = slot * rows;
      within(renderer, seen, slot * rows, rows, () => render(renderer, seeing));
    }
  }

  private receivers(places: Texture, normals: Texture, width: number, rows: number): Receivers {
    const kind = { format: RedFormat, type: UnsignedByteType, magFilter: NearestFilter, minFilter: NearestFilter, depthBuffer: false } as const;
    const seen = new RenderTarget(width, rows * this.slots.count, kind);
    const sums: [RenderTarget, RenderTarget] = [floatTarget(width, rows), floatTarget(width, rows)];
    const from = (i: 0 | 1) => pass(this.lightingNode(places, normals, seen, rows, sums[i].texture), sums[1 - i]);
    return { rows, seen, sums, seeing: pass(this.seeingNode(places, normals), seen), lighting: [from(0), from(1)], sum: texture(sums[0].texture) };
  }

  /** How much receivers see of a cell, 0 to 1: `near_seen.glsl`. */
  private seeingNode(places: Texture, normals: Texture): N {
    const { faces, size } = this.direct.occluders;
    const visible = seenAround(this.uniforms, { maps: faces.map((face) => face.texture), size });
    return Fn(() => {
      const at = ivec2(screenCoordinate).sub(ivec2(int(0), this.uniforms.first)).toVar();
      const normal = textureLoad(normals, at).xyz.toVar();
      return vec4(visible(textureLoad(places, at).xyz.add(normal.mul(this.pool.lift)), normal), 0, 0, 1);
    })();
  }

  /** `near_light.glsl`: what the sources lay on a receiver, added to `former`. */
  private lightingNode(places: Texture, normals: Texture, seen: RenderTarget, rows: number, former: Texture): N {
    const { albedo, irradiance } = this.own;
    return Fn(() => {
      const at = ivec2(screenCoordinate).toVar();
      const place = textureLoad(places, at).xyz.toVar();
      const normal = textureLoad(normals, at).xyz.toVar();
      const total = textureLoad(former, at).rgb.toVar();
      each(this.uniforms.count, "i", (i) => {
        const source = textureLoad(this.sources, ivec2(i, int(0))).toVar();
        const visible = textureLoad(seen.texture, at.add(ivec2(int(0), int(source.y.add(0.5)).mul(rows)))).r.toVar();
        If(visible.greaterThan(0), () => {
          const surfel = folded(int(source.x.add(0.5)), this.cells.width).toVar();
          const cell = textureLoad(this.direct.places, surfel).toVar();
          const factor = discFactor(cell.xyz.sub(place).toVar(), normal, textureLoad(this.direct.normals, surfel).xyz.toVar(), cell.w);
          const light = textureLoad(albedo, surfel).rgb.mul(textureLoad(irradiance, surfel).rgb);
          total.addAssign(light.mul(visible.mul(source.z).mul(factor)));
        });
      });
      return vec4(total, 1);
    })();
  }
}

/** `srbfDiscFactor`: what share of a receiver's light a surfel gives, as a disc; close to it as a square of 4 x 4 discs. */
function discFactor(toward: N, normal: N, facing: N, area: N): N {
  const far = dot(toward, facing).negate().toVar();
  const parts = select(far.greaterThan(0).and(dot(toward, toward).lessThan(area.mul(CLOSE ** 2))), int(PARTS), int(1)).toVar();
  const [tangent, bitangent] = tangents(facing);
  const part = area.div(float(parts.mul(parts))).toVar();
  const total = float(0).toVar();
  each(parts.mul(parts), "k", (k) => {
    const place = (i: N) => float(i).add(0.5).div(float(parts)).sub(0.5).mul(sqrt(area));
    const there = toward.add(tangent.mul(place(k.div(parts)))).add(bitangent.mul(place(k.mod(parts)))).toVar();
    const squared = max(dot(there, there), 1e-12).toVar();
    total.addAssign(max(dot(there, normal), 0).mul(part).div(squared.mul(squared.mul(Math.PI).add(part))));
  });
  return total.mul(max(far, 0));
}
