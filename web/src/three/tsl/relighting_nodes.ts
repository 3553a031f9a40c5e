/** An asset for three.js' WebGPURenderer, on WebGPU and on its WebGL2 backend. */
import { FloatType, HalfFloatType, LinearFilter, LinearMipmapLinearFilter, NearestFilter, RenderTarget } from "three";
import { attribute, Fn, positionWorld, screenCoordinate, texture, textureLoad, vec2, vec4 } from "three/tsl";
import { NodeMaterial, QuadMesh, type Renderer } from "three/webgpu";
import { type Asset, loadAsset, type LoadOptions } from "../../asset";
import { checkCompression } from "../../compression";
import { SrbfError } from "../../errors";
import { receiversFrom } from "../../manifest";
import { needPositions, NO_WEIGHTS } from "../../shader";
import { shapeState } from "../../shape_weights";
import type { TargetOptions } from "../lightmap_pass";
import type { MaterialOptions } from "../material";
import { SceneAsset, sourceOf } from "../scene_asset";
import { SrbfTextures } from "../textures";
import { GatherNodes } from "./gather_nodes";
import { NodeInputs } from "./inputs";
import { checkComputes } from "./kernels";
import { applyLight } from "./material";
import { type N, texelAt } from "./nodes";
import { undisturbed } from "./passes";
import { relit } from "./relit";
import { SurfelNodes } from "./surfel_nodes";

export interface RelightingNodesOptions extends TargetOptions {
  /** As in `SrbfRelightingMap`. */
  source?: "maps" | "lightmap";
  /** Room for point and spot lights; their number may change without recompiling. */
  maxPointLights?: number;
  /** As in `SrbfRelightingMap`; "compute": the tables by compute shaders, on WebGPU alone. */
  weights?: "cpu" | "gpu" | "compute";
  shadowSize?: number;
  lightsOf?: SceneAsset;
}

/** `SrbfRelightingMap` as nodes: lights as there, `light` or `apply` for materials, `update` once per frame. */
export class SrbfRelightingNodes extends SceneAsset {
  readonly textures: SrbfTextures;
  readonly source: "maps" | "lightmap";
  /** The lightmap that `update` draws; only with `source: "lightmap"`. */
  readonly target?: RenderTarget;
  /** How often the lightmap was drawn. */
  protected drawings = 0;
  protected readonly inputs: NodeInputs;
  private readonly quad?: QuadMesh;
  private readonly gpu?: SurfelNodes | GatherNodes;
  private readonly computes: boolean;
  private drawn = "";
  private weighed = "";

  /** @throws SrbfError on `source: "maps"` for a method whose layers must not be filtered. */
  constructor(asset: Asset, options: RelightingNodesOptions = {}) {
    super(asset, options.lightsOf);
    this.source = sourceOf(asset, options.source);
    const filter = this.source === "maps" ? (options.filter ?? "linear") : "nearest";
    this.textures = new SrbfTextures(asset, filter);
    const { weights = "cpu" } = options;
    const { gather } = asset.tables;
    this.computes = weights === "compute";
    if (weights !== "cpu") this.gpu = gather ? new GatherNodes(gather, options.shadowSize, this.computes) : new SurfelNodes(asset, options.shadowSize, this.computes);
    this.inputs = new NodeInputs(asset, this.textures, filter, options.maxPointLights ?? 16, this.gpu?.weights);
    if (this.source === "lightmap") {
      this.target = lightmapTarget(asset, options);
      this.quad = new QuadMesh(this.passMaterial());
    }
  }

  /** Fetch the asset at `url` (a folder with asset.json). @throws what `loadAsset` and the constructor throw. */
  static async load(url: string, options: RelightingNodesOptions & LoadOptions = {}): Promise<SrbfRelightingNodes> {
    return new SrbfRelightingNodes(await loadAsset(url, options), options);
  }

  /** The asset's light on a mesh: irradiance or radiance, a vec3 node. */
  light(options: MaterialOptions = {}): N {
    const uv = placeOf(options);
    if (this.target) return (texture(this.target.texture, uv) as N).rgb;
    const receivers = options.receivers ?? receiversFrom(this.asset.manifest);
    return relit(this.inputs, uv, receivers === "map" ? this.mapped(uv) : this.inputs.assetFromScene.mul(vec4(positionWorld as N, 1)).xyz);
  }

  /** A view's coverage, a float node; undefined where it fills its picture, and for lightmaps. */
  alpha(options: MaterialOptions = {}): N | undefined {
    const { alpha } = this.textures;
    return alpha && (texture(alpha, placeOf(options)) as N).r;
  }

  /** Light a node material by this asset; a view that does not fill its picture makes it transparent. @throws SrbfError on a material that takes no light. */
  apply<M extends NodeMaterial>(material: M, options: MaterialOptions = {}): M {
    applyLight(material, this.light(options), this.asset.manifest.quantity, this.directOf(options) === "asset", this.alpha(options));
    return material;
  }

  /**
   * Update the nodes, and the lightmap where there is one, to the current lights. The renderer is needed for `source: "lightmap"`.
   *
   * @throws SrbfError on point lights where the asset has no positions, and on more than `maxPointLights` of them.
   */
  update(renderer?: Renderer): void {
    const frame = this.gpu ? NO_WEIGHTS : this.frame();
    if (renderer) checkCompression(this.asset, (encoding) => reads(renderer, encoding));
    if (this.target) needPositions(this.asset, frame.pointLights.length);
    this.inputs.set(frame);
    this.inputs.assetFromScene.value.copy(this.assetFromScene());
    const state = this.gpu ? this.drawWeights(this.gpu, renderer) : JSON.stringify([[...frame.weights], frame.pointLights]);
    if (!this.target || !this.quad) return;
    if (!renderer) throw new SrbfError("expected a renderer to draw the lightmap with, found none; call update(renderer)");
    if (state && state === this.drawn) return;
    const kept = renderer.getRenderTarget();
    renderer.setRenderTarget(this.target);
    this.quad.render(renderer);
    renderer.setRenderTarget(kept);
    this.drawn = state;
    ++this.drawings;
  }

  dispose(): void {
    this.textures.dispose();
    this.target?.dispose();
    this.gpu?.dispose();
    (this.quad?.material as NodeMaterial | undefined)?.dispose();
  }

  /** Draw the weights of the current lights, if they have changed; returns what they depend on, nothing where three's shadows may have changed. */
  private drawWeights(gpu: SurfelNodes | GatherNodes, renderer: Renderer | undefined): string {
    if (!renderer) throw new SrbfError('expected a renderer to draw weights with, found none; call update(renderer), or take weights: "cpu"');
    if (this.computes) checkComputes(renderer);
    if (this.asset.tables.surfaces?.change) throw new SrbfError('expected the albedo of the bake for weights "gpu" of nodes, found objects that are repainted; take weights: "cpu"');
    const lights = this.looks(renderer, gpu.middle);
    const shapes = this.shapeLights();
    gpu.setShapes(shapes);
    const state = lights.flat().some(({ shadow }) => shadow) ? "" : JSON.stringify([lights, shapeState(shapes)]);
    if (!state || state !== this.weighed) undisturbed(renderer, () => gpu.draw(renderer, lights, this.placed()));
    this.weighed = state;
    return state;
  }

  private passMaterial(): NodeMaterial {
    const { width, height } = this.asset.manifest;
    const material = new NodeMaterial();
    const uv = (screenCoordinate as N).div(vec2(width, height));
    material.fragmentNode = (Fn as N)(() => vec4(relit(this.inputs, uv, this.mapped(uv)), 1))();
    material.depthTest = false;
    material.depthWrite = false;
    return material;
  }

  private mapped(uv: N): N {
    const { positions } = this.textures;
    if (!positions) return vec4(0).xyz;
    return (textureLoad(positions, texelAt(uv, this.asset.manifest.width, this.asset.manifest.height)) as N).xyz;
  }
}

function placeOf(options: MaterialOptions): N {
  const channel = options.channel ?? 1;
  const own = attribute(channel === 0 ? "uv" : `uv${channel}`, "vec2") as N;
  return options.uvOrigin === "bottom" ? vec2(own.x, own.y.oneMinus()) : own;
}

function reads(renderer: Renderer, encoding: "bc7" | "bc1"): boolean {
  if (encoding === "bc7" || (renderer.backend as { isWebGPUBackend?: boolean }).isWebGPUBackend) return renderer.hasFeature("texture-compression-bc");
  return renderer.hasFeature("texture-compression-s3tc");
}

function lightmapTarget(asset: Asset, options: TargetOptions): RenderTarget {
  const { target = "half", filter = "linear", mipmaps = false, anisotropy = 1 } = options;
  return new RenderTarget(asset.manifest.width, asset.manifest.height, {
    type: target === "half" ? HalfFloatType : FloatType,
    depthBuffer: false,
    magFilter: filter === "linear" ? LinearFilter : NearestFilter,
    minFilter: mipmaps ? LinearMipmapLinearFilter : filter === "linear" ? LinearFilter : NearestFilter,
    generateMipmaps: mipmaps,
    anisotropy,
  });
}
