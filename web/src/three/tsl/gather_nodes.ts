/**
 * `GatherWeights` for WebGPURenderer: the irradiance of a deep framebuffer's view clusters, and what lobes gather, by passes of nodes; on WebGPU the last of
 * them by compute shaders, where asked. Nothing is read back: the CPU finds bright surfels by shadow rays of its own.
 */
import type { DataTexture, RenderTarget, Texture } from "three";
import { Vector3 } from "three";
import * as tsl from "three/tsl";
import type { Renderer } from "three/webgpu";
import { SrbfError } from "../../errors";
import { ACROSS, type Gather, weightRows } from "../../gather";
import type { Triple } from "../../matrix";
import type { NearSources } from "../../near_sources";
import { LinkedLight } from "../../linked_light";
import type { ShapeLights } from "../../shape_weights";
import { type PackedCells, packedCells, type Placed } from "../../surfels";
import { keyOf, type ShadowedLook } from "../engine_shadows";
import { colorTexture } from "../pool_textures";
import { IrradianceNodes } from "./irradiance_nodes";
import { compute, floatStorage, summingKernel } from "./kernels";
import { LinkNodes } from "./linked_nodes";
import { NearNodes } from "./near_nodes";
import type { N } from "./nodes";
import { cleared, disposeOf, floatTarget, type Pass, pass, render } from "./passes";

const { Fn, If, int, ivec2, screenCoordinate, texture, textureLoad, uniform, vec3, vec4, workgroupId } = tsl as Record<string, N>;

/** What view clusters and lobes gather of a light in white: drawn by a pass into its target, or by a kernel into its texture. */
interface Gathered {
  texture: Texture;
  draw(renderer: Renderer): void;
  dispose(): void;
}

export class GatherNodes {
  readonly middle: Triple;
  /** How often the bounces of a light were computed. */
  computed = 0;
  private readonly cells: PackedCells;
  private readonly direct: IrradianceNodes;
  private readonly near?: NearNodes;
  private readonly received: LinkedLight;
  /** Of the surfels, a texture node. */
  private readonly irradiance: N;
  private readonly textures: DataTexture[];
  private readonly links: { exchange: LinkNodes; view: LinkNodes; gloss?: LinkNodes };
  private readonly radiosity: [RenderTarget, RenderTarget];
  private readonly bounces: Pass[];
  /** What lobes see of surfels. */
  private readonly shown?: Pass;
  /** Rows of the clusters, and of the lobes after them. */
  private readonly rows: [number, number];
  private known = new Map<string, Gathered>();
  private readonly unused: Gathered[] = [];
  /** The sum of all lights, the first; and what is drawn in turn with it. */
  private readonly sums: [RenderTarget, RenderTarget];
  private readonly adding: [Pass, Pass];
  private readonly added: { light: N; color: N };

  /** `computed`: by compute shaders, on WebGPU alone. */
  constructor(
    private readonly gather: Gather,
    shadowSize = 1024,
    private readonly computes = false,
  ) {
    const cells = (this.cells = packedCells(gather.surfels));
    this.middle = cells.middle;
    this.received = new LinkedLight(gather.surfels);
    this.direct = new IrradianceNodes(gather.surfels, cells, shadowSize, true);
    this.irradiance = texture(this.direct.sums[0].texture);
    const albedo = colorTexture(gather.albedo, cells);
    const specular = gather.specular && colorTexture(gather.specular, cells);
    this.textures = [albedo, ...(specular ? [specular] : [])];
    if (gather.near) this.near = new NearNodes(gather.near, cells, this.direct, { albedo, irradiance: this.irradiance });
    const { exchange, view, gloss } = gather;
    this.links = { exchange: new LinkNodes(exchange), view: new LinkNodes(view), ...(gloss ? { gloss: new LinkNodes(gloss) } : {}) };
    this.radiosity = [floatTarget(cells.width, cells.height), floatTarget(cells.width, cells.height)];
    this.bounces = Array.from({ length: gather.terms }, (_, term) => {
      if (term > 2) return undefined; // two of them in turn
      const [from, to] = [this.radiosity[term % 2], this.radiosity[(term + 1) % 2]];
      return pass(this.bounceNode(albedo, term > 0 ? from : undefined), to);
    }).filter((one) => one !== undefined);
    if (gloss) this.shown = pass(this.shownNode(albedo, specular), floatTarget(cells.width, cells.height));
    this.rows = weightRows(gather);
    const size = [ACROSS, this.rows[0] + this.rows[1]] as const;
    this.sums = [floatTarget(...size), floatTarget(...size)];
    this.added = { light: texture(this.sums[0].texture), color: uniform(new Vector3()) };
    const adding = (i: 0 | 1) => pass(this.addingNode(this.sums[i].texture), this.sums[1 - i]);
    this.adding = [adding(0), adding(1)];
  }

  get weights(): Texture {
    return this.sums[0].texture;
  }

  setShapes({ named }: ShapeLights): void {
    if (named.length) throw new SrbfError(`expected lights inside the scene for a deep framebuffer, found ${JSON.stringify(named[0].name)}`);
  }

  /** Draw the irradiance under lights, each a list of looks of one color; `placed`: the lights themselves. Within `undisturbed`. */
  draw(renderer: Renderer, lights: readonly (readonly ShadowedLook[])[], placed: readonly (readonly Placed[])[]): void {
    const kept = new Map<string, Gathered>();
    const shining = lights.flatMap((looks, i) => {
      if (!looks.length) return [];
      const key = keyOf(looks);
      const found = key === undefined ? undefined : (this.known.get(key) ?? kept.get(key));
      const gathered = found ?? this.white(renderer, looks, placed[i][0]);
      kept.set(key ?? `shadow ${kept.size}`, gathered);
      if (key !== undefined) this.known.delete(key);
      const [{ color, factor }] = looks;
      return [{ gathered, color: color.map((x) => (factor ? x : x * looks.length)) }];
    });
    this.unused.push(...this.known.values());
    this.known = kept;
    let from = (shining.length % 2) as 0 | 1; // the last pass ends in the first
    cleared(renderer, this.sums[from]);
    for (const { gathered, color } of shining) {
      this.added.light.value = gathered.texture;
      this.added.color.value.set(...(color as unknown as Triple));
      render(renderer, this.adding[from]);
      from = from === 0 ? 1 : 0;
    }
  }

  dispose(): void {
    const { exchange, view, gloss } = this.links;
    disposeOf([...this.bounces, ...this.adding, ...(this.shown ? [this.shown] : [])]);
    for (const one of [this.direct, this.near, exchange, view, gloss, this.shown?.target, ...this.textures, ...this.radiosity, ...this.sums, ...this.known.values(), ...this.unused]) one?.dispose();
  }

  /** Of a light in white. */
  private white(renderer: Renderer, looks: readonly ShadowedLook[], light: Placed): Gathered {
    const gathered = this.unused.pop() ?? this.made();
    const share = 1 / looks.length;
    const from = this.direct.draw(renderer, looks.map((look) => ({ ...look, color: look.factor ?? ([share, share, share] as Triple) })));
    this.irradiance.value = this.direct.sums[from].texture;
    this.near?.draw(renderer, this.bright(light));
    for (let term = 0; term < this.gather.terms; ++term) render(renderer, this.bounces[term < 3 ? term : 2 - (term % 2)]);
    if (this.gather.terms === 0) cleared(renderer, this.radiosity[0]);
    if (this.shown) render(renderer, this.shown);
    gathered.draw(renderer);
    ++this.computed;
    return gathered;
  }

  /** The surfels that are far brighter than the mean under a light. */
  private bright(light: Placed): NearSources | undefined {
    return this.gather.near?.sources(this.received.under(light), "position" in light ? light.position : undefined);
  }

  private made(): Gathered {
    const size = [ACROSS, this.rows[0] + this.rows[1]] as const;
    if (this.computes) {
      const made = floatStorage(...size);
      const kernel = summingKernel(made, () => ivec2(int(workgroupId.x), int(workgroupId.y)), (at, thread) => this.gathered(at, thread), (sum, at) => sum.add(this.beside(at)));
      return { texture: made, draw: (renderer) => compute(renderer, kernel, [...size, 1]), dispose: () => [made, kernel].forEach((one) => one.dispose()) };
    }
    const node = Fn(() => {
      const at = ivec2(screenCoordinate).toVar();
      return vec4(this.gathered(at).add(this.beside(at)), 1);
    })();
    const one = pass(node, floatTarget(...size));
    return {
      texture: one.target.texture,
      draw: (renderer) => render(renderer, one),
      dispose: () => {
        disposeOf([one]);
        one.target.dispose();
      },
    };
  }

  /** What a cluster or a lobe gathers by its links, or what one thread adds to it. */
  private gathered(at: N, thread?: N): N {
    const { view, gloss } = this.links;
    const { width } = this.cells;
    const last = texture(this.radiosity[this.gather.terms % 2].texture);
    if (!gloss || !this.shown) return view.light(at, last, width, thread);
    const seen = texture(this.shown.target.texture);
    const total = vec3(0).toVar();
    If(at.y.lessThan(this.rows[0]), () => {
      total.assign(view.light(at, last, width, thread));
    }).Else(() => {
      total.assign(gloss.light(at.sub(ivec2(0, this.rows[0])).toVar(), seen, width, thread));
    });
    return total;
  }

  /** What bright surfels lay on a cluster. */
  private beside(at: N): N {
    if (!this.near) return vec3(0);
    const total = vec3(0).toVar();
    If(at.y.lessThan(this.rows[0]), () => {
      total.assign(textureLoad(this.near?.sums.clusters, at).rgb);
    });
    return total;
  }

  /** `deep_framebuffer_bounce.frag`: what surfels reflect of direct irradiance, and of the `light` of others. */
  private bounceNode(albedo: Texture, light: RenderTarget | undefined): N {
    return Fn(() => {
      const at = ivec2(screenCoordinate).toVar();
      const arriving = this.far(at).toVar();
      if (light) arriving.addAssign(this.arriving(at, texture(light.texture)));
      return vec4(textureLoad(albedo, at).rgb.mul(arriving), 1);
    })();
  }

  /** What lobes see of surfels: all that they reflect diffusely, and what they reflect toward lobes beside. */
  private shownNode(albedo: Texture, specular: Texture | undefined): N {
    const last = texture(this.radiosity[this.gather.terms % 2].texture);
    return Fn(() => {
      const at = ivec2(screenCoordinate).toVar();
      const direct = textureLoad(this.irradiance, at).rgb;
      const total = textureLoad(last, at).rgb.toVar();
      if (this.near) total.addAssign(textureLoad(albedo, at).rgb.mul(direct).mul(textureLoad(this.near.parts, at).r));
      if (specular && this.gather.terms) total.addAssign(textureLoad(specular, at).rgb.mul(direct.add(this.arriving(at, last))));
      return vec4(total, 1);
    })();
  }

  /** Direct irradiance less what is taken out of the links. */
  private far(at: N): N {
    const direct = textureLoad(this.irradiance, at).rgb;
    return this.near ? direct.mul(textureLoad(this.near.parts, at).r.oneMinus()) : direct;
  }

  /** What other surfels lay on one. */
  private arriving(at: N, light: N): N {
    const { width } = this.cells;
    const linked = this.links.exchange.light(LinkNodes.at(at.y.mul(width).add(at.x)).toVar(), light, width);
    return this.near ? linked.add(textureLoad(this.near.sums.surfels, at).rgb) : linked;
  }

  /** `deep_framebuffer_sum.frag`. */
  private addingNode(former: Texture): N {
    return Fn(() => {
      const at = ivec2(screenCoordinate).toVar();
      return vec4(textureLoad(former, at).rgb.add(this.added.color.mul(textureLoad(this.added.light, at).rgb)), 1);
    })();
  }
}
