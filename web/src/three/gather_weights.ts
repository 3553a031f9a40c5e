/**
 * The irradiance of a deep framebuffer's view clusters, and what lobes gather, computed by the GPU: direct light on its surfels, bounces between them, links to
 * clusters and lobes.
 * A light that has not moved is kept, so that another color, or another light, costs one small pass. Of one that has moved, direct light is read back
 * where bright surfels light in closed form, which the CPU finds.
 */
import { type DataTexture, type Texture, type WebGLRenderer, type WebGLRenderTarget } from "three";
import bounceStage from "../../../glsl/stages/deep_framebuffer_bounce.frag";
import clustersStage from "../../../glsl/stages/deep_framebuffer_clusters.frag";
import sumStage from "../../../glsl/stages/deep_framebuffer_sum.frag";
import { SrbfError } from "../errors";
import { ACROSS, type Gather, type PackedLinks, weightRows } from "../gather";
import type { ShapeLights } from "../shape_weights";
import type { Triple } from "../matrix";
import { packedCells } from "../surfels";
import { keyOf, type ShadowedLook } from "./engine_shadows";
import { floatTarget } from "./float_textures";
import { FullscreenPass, within } from "./fullscreen";
import { NearIrradiance } from "./near_irradiance";
import { colorTexture } from "./pool_textures";
import { SurfelIrradiance } from "./surfel_irradiance";
import { tableTexture } from "./textures";

export class GatherWeights {
  readonly middle: Triple;
  /** How often the bounces of a light were computed. */
  computed = 0;
  private readonly direct: SurfelIrradiance;
  private readonly near?: NearIrradiance;
  private readonly albedo: DataTexture;
  /** What lobes see surfels reflect beside that, and a target for it. */
  private readonly specular?: { albedo: DataTexture; target: WebGLRenderTarget };
  private readonly links: DataTexture[];
  private readonly radiosity: [WebGLRenderTarget, WebGLRenderTarget];
  /** Rows of the clusters, and of the lobes after them. */
  private readonly rows: [number, number];
  /** The sum of all lights, the first; and what is drawn in turn with it. */
  private readonly sums: [WebGLRenderTarget, WebGLRenderTarget];
  private readonly size: [number, number];
  private readonly bounce: FullscreenPass;
  private readonly clusters: FullscreenPass;
  private readonly lobes?: FullscreenPass;
  private readonly sum: FullscreenPass;
  /** Irradiance of the clusters by lights in white. */
  private known = new Map<string, WebGLRenderTarget>();
  private readonly unused: WebGLRenderTarget[] = [];

  constructor(
    private readonly gather: Gather,
    shadowSize = 1024,
  ) {
    const cells = packedCells(gather.surfels);
    this.middle = cells.middle;
    this.direct = new SurfelIrradiance(gather.surfels, cells, shadowSize, { SRBF_MEAN_NORMALS: 1 });
    if (gather.near) this.near = new NearIrradiance(gather, gather.near, cells, this.direct);
    this.albedo = colorTexture(gather.albedo, cells);
    if (gather.specular) this.specular = { albedo: colorTexture(gather.specular, cells), target: floatTarget(cells.width, cells.height) };
    this.radiosity = [floatTarget(cells.width, cells.height), floatTarget(cells.width, cells.height)];
    this.rows = weightRows(gather);
    this.size = [ACROSS, this.rows[0] + this.rows[1]];
    this.sums = [floatTarget(...this.size), floatTarget(...this.size)];
    const [exchange, view] = [gather.exchange, gather.view].map((links) => linkUniforms(links));
    const gloss = gather.gloss && linkUniforms(gather.gloss, this.rows[0]);
    this.links = [exchange, view, ...(gloss ? [gloss] : [])].flatMap(({ links, rows }) => [links.value, rows.value]);
    this.bounce = new FullscreenPass(bounceStage, { ...exchange, light: { value: null }, direct: { value: null }, albedo: { value: this.albedo }, first: { value: 1 } });
    this.clusters = new FullscreenPass(clustersStage, { ...view, light: { value: null } });
    if (gloss) this.lobes = new FullscreenPass(clustersStage, { ...gloss, light: { value: null } });
    this.sum = new FullscreenPass(sumStage, { former: { value: null }, light: { value: null }, color: { value: [0, 0, 0] } });
  }

  get weights(): Texture {
    return this.sums[0].texture;
  }

  setShapes({ named }: ShapeLights): void {
    if (named.length) throw new SrbfError(`expected lights inside the scene for a deep framebuffer, found ${JSON.stringify(named[0].name)}`);
  }

  /** Draw the irradiance under lights, each a list of looks of one color; within `undisturbed`. */
  draw(renderer: WebGLRenderer, lights: readonly (readonly ShadowedLook[])[]): void {
    const shining = lights.filter((looks) => looks.length > 0);
    const kept = new Map<string, WebGLRenderTarget>();
    const irradiance = shining.map((looks) => {
      const key = keyOf(looks);
      const found = key === undefined ? undefined : (this.known.get(key) ?? kept.get(key));
      const target = found ?? this.white(renderer, looks);
      kept.set(key ?? `shadow ${kept.size}`, target);
      if (key !== undefined) this.known.delete(key);
      return target;
    });
    this.unused.push(...this.known.values());
    this.known = kept;
    let [former, next] = shining.length % 2 ? [this.sums[1], this.sums[0]] : this.sums; // the last pass ends in the first
    renderer.setRenderTarget(former);
    renderer.setClearColor(0, 0);
    renderer.clear(true, false, false);
    irradiance.forEach(({ texture }, i) => {
      const [look] = shining[i];
      this.add(renderer, former.texture, texture, look.color.map((x) => (look.factor ? x : x * shining[i].length)), next);
      [former, next] = [next, former];
    });
  }

  dispose(): void {
    const targets = [...this.radiosity, ...this.sums, ...this.known.values(), ...this.unused];
    this.near?.dispose();
    for (const one of [this.direct, this.albedo, ...this.links, ...targets, this.bounce, this.clusters, this.sum]) one.dispose();
    for (const one of [this.lobes, this.specular?.albedo, this.specular?.target]) one?.dispose();
  }

  private add(renderer: WebGLRenderer, former: Texture, light: Texture, color: number[], target: WebGLRenderTarget): void {
    for (const [name, value] of Object.entries({ former, light, color })) this.sum.uniforms[name].value = value;
    this.sum.draw(renderer, target);
  }

  /** Of a light in white. */
  private white(renderer: WebGLRenderer, looks: readonly ShadowedLook[]): WebGLRenderTarget {
    const target = this.unused.pop() ?? floatTarget(...this.size);
    const share = 1 / looks.length;
    const direct = this.direct.draw(renderer, looks.map((look) => ({ ...look, color: look.factor ?? ([share, share, share] as Triple) })));
    const near = this.near?.draw(renderer, direct, looks);
    let [light, next] = this.radiosity;
    for (let term = 0; term < this.gather.terms; ++term) {
      this.reflect(renderer, near ? (term ? near.second : near.far) : direct.texture, light.texture, this.albedo, term === 0, next);
      [light, next] = [next, light];
    }
    if (this.gather.terms === 0) {
      renderer.setRenderTarget(light);
      renderer.clear(true, false, false);
    }
    const [rows] = this.rows;
    this.clusters.uniforms.light.value = light.texture;
    const [, linked] = this.sums;
    within(near ? linked : target, 0, rows, (part) => this.clusters.draw(renderer, part));
    if (near) within(target, 0, rows, (part) => this.add(renderer, linked.texture, near.clusters, [1, 1, 1], part));
    if (this.lobes) this.gatherGloss(renderer, this.lobes, light, near?.second ?? direct.texture, near?.taken, target);
    ++this.computed;
    return target;
  }

  /** What surfels of an `albedo` reflect of direct irradiance, and unless they are the `first` of the `light` of others. */
  private reflect(renderer: WebGLRenderer, direct: Texture, light: Texture, albedo: Texture, first: boolean, target: WebGLRenderTarget): void {
    for (const [name, value] of Object.entries({ direct, light, albedo, first: first ? 1 : 0 })) this.bounce.uniforms[name].value = value;
    this.bounce.draw(renderer, target);
  }

  /** What lobes gather: surfels reflect more toward them than toward others. `arriving`: on the surfels, beside links; `taken`: what bright ones reflect of what links lack. */
  private gatherGloss(renderer: WebGLRenderer, lobes: FullscreenPass, radiosity: WebGLRenderTarget, arriving: Texture, taken: Texture | undefined, target: WebGLRenderTarget): void {
    let [seen, next] = radiosity === this.radiosity[0] ? this.radiosity : [this.radiosity[1], this.radiosity[0]];
    const more = (light: Texture) => {
      this.add(renderer, seen.texture, light, [1, 1, 1], next);
      [seen, next] = [next, seen];
    };
    if (this.specular && this.gather.terms) {
      this.reflect(renderer, arriving, seen.texture, this.specular.albedo, false, this.specular.target);
      more(this.specular.target.texture);
    }
    if (taken) more(taken);
    lobes.uniforms.light.value = seen.texture;
    const [before, own] = this.rows;
    within(target, before, own, (part) => lobes.draw(renderer, part));
  }
}

/** `before`: rows of the target before theirs. */
function linkUniforms({ links, rows, rays }: PackedLinks, before = 0) {
  const data = new Float32Array(4 * ACROSS * before + rows.data.length);
  data.set(rows.data, 4 * ACROSS * before);
  return { links: { value: tableTexture(links) }, rows: { value: tableTexture({ ...rows, height: rows.height + before, data }) }, rays: { value: rays } };
}
