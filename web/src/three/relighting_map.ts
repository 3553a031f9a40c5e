/** An asset in a three.js scene: its textures, the lights that it follows, the materials that it lights. */
import type { Material, Matrix4, Texture, WebGLRenderer } from "three";
import { type Asset, loadAsset, type LoadOptions } from "../asset";
import { checkCompression } from "../compression";
import { SrbfError } from "../errors";
import { receiversFrom } from "../manifest";
import { pointLightRoom } from "../point_light";
import { needPositions, NO_WEIGHTS, uniformVectors } from "../shader";
import { shapeState } from "../shape_weights";
import { undisturbed } from "./fullscreen";
import { checkDrawsFloats, type GpuWeights, gpuWeights } from "./gpu_weights";
import { type Added, LightmapPass, type TargetOptions } from "./lightmap_pass";
import { checkMaterial, type MaterialOptions, onCompile, type Patch, patchKey, patchShader } from "./material";
import { SceneAsset, sourceOf } from "./scene_asset";
import { SrbfTextures } from "./textures";
import { assetUniforms, setFrame, type Uniforms } from "./uniforms";

export interface RelightingMapOptions extends TargetOptions {
  /**
   * `maps`: materials sum the layers at every pixel. `lightmap`: `update` draws a lightmap whenever a light changes, and materials sample it, with mip
   * maps if asked for; the only choice for layers that must not be filtered, of clusters and neural maps.
   */
  source?: "maps" | "lightmap";
  /**
   * Where the weights of lights inside a scene are computed: `cpu`, by rays or the asset's table; `gpu`, by passes over the cells of its surfaces, with
   * three's shadow maps of lights that cast shadows and the asset's own of all others.
   */
  weights?: "cpu" | "gpu";
  /** Texels per side of a face of the asset's own shadow maps, with `weights: "gpu"`: 512, of deep framebuffers 1024, unless given. */
  shadowSize?: number;
  /** An asset whose lights shine on this one, too: what is followed, set or moved there counts here. */
  lightsOf?: SceneAsset;
}

const EXTENSIONS = { bc7: "EXT_texture_compression_bptc", bc1: "WEBGL_compressed_texture_s3tc" };
const VECTORS_KEPT_FREE = 48; // vec4 of three's own uniforms in a lit material

/**
 * An asset that lights three.js materials. Add lights by `follow` (three's own, in three's world) or to `lights` (of the library, in the asset's
 * world: Blender's, z up), call `update` once per frame, `dispose` at the end.
 */
export class SrbfRelightingMap extends SceneAsset {
  readonly textures: SrbfTextures;
  readonly source: "maps" | "lightmap";
  private readonly uniforms: Uniforms;
  private readonly pass?: LightmapPass;
  private readonly patched = new Map<Material, Patch>();
  private room = 1;
  private readonly gpu?: GpuWeights;
  /** How often the lightmap was drawn. */
  protected drawings = 0;
  private drawn = "";
  private weighed = "";
  private added: Added | undefined;

  /** @throws SrbfError on `source: "maps"` for a method whose layers must not be filtered. */
  constructor(asset: Asset, options: RelightingMapOptions = {}) {
    super(asset, options.lightsOf);
    this.source = sourceOf(asset, options.source);
    this.textures = new SrbfTextures(asset, this.source === "maps" ? (options.filter ?? "linear") : "nearest");
    this.uniforms = assetUniforms(asset, this.textures);
    if (options.weights === "gpu") {
      this.gpu = gpuWeights(asset, options.shadowSize);
      this.uniforms.srbfWeights.value = this.gpu.weights;
    }
    if (this.source === "lightmap") {
      this.pass = new LightmapPass(asset, this.uniforms, options);
      this.uniforms.srbfLightmap = { value: this.pass.target.texture };
    }
  }

  /** Fetch the asset at `url` (a folder with asset.json). @throws what `loadAsset` and the constructor throw. */
  static async load(url: string, options: RelightingMapOptions & LoadOptions = {}): Promise<SrbfRelightingMap> {
    return new SrbfRelightingMap(await loadAsset(url, options), options);
  }

  /** The lightmap of an asset that always has one. */
  protected get facets(): Texture {
    return this.lightmap as Texture;
  }

  /** The lightmap that `update` draws (v downwards), for your own shaders; only with `source: "lightmap"`. */
  get lightmap(): Texture | undefined {
    return this.pass?.target.texture;
  }

  /**
   * Add `texture`, of the asset's size, to the sum of its maps before the clamp, or show it `alone`: an indirect asset's direct light, in its quantity.
   * Only with `source: "lightmap"`; the next `update` draws it.
   */
  add(texture?: Texture, alone = false): void {
    if (!texture && !this.added) return; // nothing to redraw
    this.added = texture && { texture, alone };
    this.drawn = "";
  }

  /** Light `material` by this asset; a view that does not fill its picture makes it transparent. @throws SrbfError on a material of another kind than Standard, Physical, Lambert, Basic. */
  apply<M extends Material>(material: M, options: MaterialOptions = {}): M {
    checkMaterial(material);
    if (this.patched.has(material)) return material;
    const { manifest } = this.asset;
    const patch: Patch = {
      asset: this.asset,
      uniforms: this.uniforms,
      source: this.source,
      room: this.room,
      options: {
        channel: options.channel ?? 1,
        uvOrigin: options.uvOrigin ?? "top",
        receivers: options.receivers ?? receiversFrom(manifest),
        direct: this.directOf(options),
      },
    };
    if (patch.options.receivers === "map") needPositions(this.asset, 1);
    this.patched.set(material, patch);
    if (this.asset.alpha) material.transparent = true;
    return onCompile(material, () => patchKey(patch), (shader) => patchShader(shader, material, patch));
  }

  /**
   * Update the uniforms, and the lightmap where there is one, to the current lights. The renderer is needed for `source: "lightmap"`.
   *
   * @throws SrbfError on point lights where the asset has no positions, or more layers and point lights than the GPU's uniforms hold.
   */
  update(renderer?: WebGLRenderer): void {
    const frame = this.gpu ? NO_WEIGHTS : this.frame();
    if (this.pass) needPositions(this.asset, frame.pointLights.length);
    if (renderer) {
      checkCompression(this.asset, (encoding) => renderer.extensions.has(EXTENSIONS[encoding]));
      this.checkUniforms(renderer, pointLightRoom(frame.pointLights.length));
    }
    setFrame(this.uniforms, this.textures, frame);
    (this.uniforms.srbfAssetFromScene.value as Matrix4).copy(this.assetFromScene());
    const room = pointLightRoom(frame.pointLights.length);
    if (room !== this.room) this.recompile(room);
    const state = this.gpu ? this.drawWeights(this.gpu, renderer) : JSON.stringify([[...frame.weights], frame.pointLights]);
    if (this.pass) this.redraw(state, renderer);
  }

  dispose(): void {
    this.textures.dispose();
    this.pass?.dispose();
    this.gpu?.dispose();
  }

  /** Draw the weights of the current lights, if they have changed; returns what they depend on, nothing where three's shadows may have changed. */
  private drawWeights(gpu: GpuWeights, renderer: WebGLRenderer | undefined): string {
    if (!renderer) throw new SrbfError('expected a renderer to draw weights with, found none; call update(renderer), or take weights: "cpu"');
    const lights = this.looks(renderer, gpu.middle);
    const shapes = this.shapeLights();
    gpu.setShapes(shapes);
    const state = lights.flat().some(({ shadow }) => shadow) ? "" : JSON.stringify([lights, shapeState(shapes), this.asset.tables.surfaces?.version]);
    if (!state || state !== this.weighed) {
      checkDrawsFloats(renderer);
      undisturbed(renderer, () => gpu.draw(renderer, lights));
    }
    this.weighed = state;
    return state;
  }

  private redraw(state: string, renderer: WebGLRenderer | undefined): void {
    if (!renderer) throw new SrbfError("expected a renderer to draw the lightmap with, found none; call update(renderer)");
    if (state && state === this.drawn) return;
    this.pass?.draw(renderer, this.added);
    ++this.drawings;
    this.drawn = state;
  }

  private recompile(room: number): void {
    this.room = room;
    for (const [material, patch] of this.patched) {
      patch.room = room;
      if (this.source === "maps") material.needsUpdate = true;
    }
  }

  private checkUniforms(renderer: WebGLRenderer, room: number): void {
    const most = renderer.capabilities.maxFragmentUniforms - (this.pass ? 0 : VECTORS_KEPT_FREE);
    const needed = uniformVectors(this.asset, room);
    if (needed > most) {
      throw new SrbfError(
        `expected at most ${most} vectors of uniforms on this GPU, found ${needed} for ${this.asset.layers.count} layers and ${room} point lights; ` +
          (this.pass ? "fit with fewer layers or hidden units, or follow fewer point lights" : 'take source: "lightmap", or an eigen map'),
      );
    }
  }
}
