/** `SrbfProbes` for WebGPURenderer, on WebGPU and on its WebGL2 backend. */
import { FloatType, HalfFloatType, NearestFilter, RenderTarget } from "three";
import { normalWorld, positionWorld, vec4 } from "three/tsl";
import type { NodeMaterial, Renderer } from "three/webgpu";
import { type Asset, loadAsset, type LoadOptions } from "../../asset";
import { SrbfError } from "../../errors";
import { LIGHT_TEXELS, probesOf } from "../../probes";
import type { MaterialOptions } from "../material";
import { type ProbeTextures, probeTextures } from "../probe_light";
import { applyLight } from "./material";
import type { N } from "./nodes";
import { disposeOf, type Pass, pass, render } from "./passes";
import { harmonicsNode, probeIrradiance } from "./probe_irradiance";
import { type RelightingNodesOptions, SrbfRelightingNodes } from "./relighting_nodes";

export type ProbeNodesOptions = Pick<RelightingNodesOptions, "weights" | "shadowSize" | "target" | "lightsOf">;

/** `SrbfProbes` as nodes: `irradiance` or `apply` for materials, `update` once per frame. */
export class SrbfProbeNodes extends SrbfRelightingNodes {
  private readonly sources: ProbeTextures;
  private readonly harmonics: Pass;
  private readonly lookup: (place: N, normal: N) => N;
  private lit = -1;

  /** @throws SrbfError on an asset of other receivers. */
  constructor(asset: Asset, { weights, shadowSize, target = "half", lightsOf }: ProbeNodesOptions = {}) {
    const probes = probesOf(asset);
    super(asset, { source: "lightmap", filter: "nearest", weights, shadowSize, target, lightsOf });
    const [x, y, z] = probes.counts;
    this.sources = probeTextures(probes);
    const drawn = new RenderTarget(LIGHT_TEXELS * x, y * z, { type: target === "half" ? HalfFloatType : FloatType, magFilter: NearestFilter, minFilter: NearestFilter, depthBuffer: false });
    this.harmonics = pass(harmonicsNode(probes, this.sources, (this.target as RenderTarget).texture), drawn);
    this.lookup = probeIrradiance(probes, this.sources, drawn.texture);
  }

  /** Fetch the asset at `url` (a folder with asset.json). @throws what `loadAsset` and the constructor throw. */
  static override async load(url: string, options: ProbeNodesOptions & LoadOptions = {}): Promise<SrbfProbeNodes> {
    return new SrbfProbeNodes(await loadAsset(url, options), options);
  }

  /** Irradiance on a mesh between the probes, a vec3 node; by its material's normal unless another is given, unit and in three's world. */
  override light({ normal = normalWorld as N }: MaterialOptions & { normal?: N } = {}): N {
    const { assetFromScene } = this.inputs;
    return this.lookup(assetFromScene.mul(vec4(positionWorld as N, 1)).xyz, assetFromScene.mul(vec4(normal, 0)).xyz.normalize());
  }

  /** Light a node material by the probes around it, wherever its mesh is. @throws SrbfError on a material that takes no light by normals. */
  override apply<M extends NodeMaterial>(material: M, options: Pick<MaterialOptions, "direct"> = {}): M {
    if (!material.lights) throw new SrbfError(`expected a lit node material for probes, found ${material.type}; use the node of light() in it yourself`);
    applyLight(material, this.light(), "irradiance", this.directOf(options) === "asset");
    return material;
  }

  override update(renderer: Renderer): void {
    super.update(renderer);
    if (this.lit === this.drawings) return;
    const kept = renderer.getRenderTarget();
    render(renderer, this.harmonics);
    renderer.setRenderTarget(kept);
    this.lit = this.drawings;
  }

  override dispose(): void {
    super.dispose();
    disposeOf([this.harmonics]);
    for (const one of [this.harmonics.target, this.sources.places, this.sources.nearness]) one.dispose();
  }
}
