/** An asset in a Babylon.js scene: its textures, its lights, the materials that it lights. */
import { PBRMaterial } from "@babylonjs/core/Materials/PBR/pbrMaterial.js";
import type { Scene } from "@babylonjs/core/scene.js";
import { type Asset, loadAsset, type LoadOptions } from "../asset";
import { pointLightRoom, packedPointLights } from "../point_light";
import type { Light } from "../lights";
import { receiversFrom } from "../manifest";
import { asDesigned, setNamedLight } from "../named_lights";
import { columnMajor, type Matrix4, multiplied, type Triple, Z_UP_FROM_Y_UP } from "../matrix";
import { frameValues, needPositions } from "../shader";
import { type PluginOptions, type SharedFrame, SrbfPlugin } from "./plugin";
import { BabylonTextures } from "./textures";

/** Blender's world from Babylon's left-handed one, as its glTF loader turns scenes: (x, y, z) to (-x, -z, y). */
export const Z_UP_FROM_LEFT_HANDED: Matrix4 = [
  [-1, 0, 0, 0],
  [0, 0, -1, 0],
  [0, 1, 0, 0],
  [0, 0, 0, 1],
];

/** An asset that lights PBR materials of Babylon.js under WebGL2. Set `lights`, call `update` after every change, and `dispose` at the end. */
export class SrbfRelightingMap {
  /** In the asset's world: Blender's, z up, meters. */
  readonly lights: Light[] = [];
  /** Blender's world from the scene's; where meshes of the asset were moved, with the inverse of that. */
  worldFromScene: Matrix4;
  readonly textures: BabylonTextures;
  private readonly frame: SharedFrame;
  private readonly plugins: SrbfPlugin[] = [];

  /** `filter` of the layers; clusters are mixed in the shader, from four texels each. @throws SrbfError on block-compressed layers. */
  constructor(
    readonly asset: Asset,
    scene: Scene,
    options: { filter?: "linear" | "nearest" } = {},
  ) {
    this.worldFromScene = scene.useRightHandedSystem ? Z_UP_FROM_Y_UP : Z_UP_FROM_LEFT_HANDED;
    this.lights.push(...asDesigned(asset));
    const filter = options.filter ?? "linear";
    this.textures = new BabylonTextures(asset, scene, filter);
    this.frame = { filtered: filter === "linear", weights: new Float32Array(0), pointLights: new Float32Array(16), pointLightCount: 0, room: 1, assetFromScene: new Float32Array(16) };
    this.update();
  }

  /** Fetch the asset at `url` (a folder with asset.json). @throws what `loadAsset` and the constructor throw. */
  static async load(url: string, scene: Scene, options: { filter?: "linear" | "nearest" } & LoadOptions = {}): Promise<SrbfRelightingMap> {
    return new SrbfRelightingMap(await loadAsset(url, options), scene, options);
  }

  /** Light `material` by this asset: irradiance replaces its direct diffuse light, radiance replaces all its light. */
  apply(material: PBRMaterial, options: PluginOptions = {}): PBRMaterial {
    const { manifest } = this.asset;
    const receivers = options.receivers ?? receiversFrom(manifest);
    if (receivers === "map") needPositions(this.asset, 1);
    const direct = options.direct ?? (manifest.transport === "indirect" ? "engine" : "asset");
    const chosen = { uv: options.uv ?? "uv2", uvOrigin: options.uvOrigin ?? "top", receivers, direct } as const;
    if (this.asset.alpha) material.transparencyMode = PBRMaterial.PBRMATERIAL_ALPHABLEND;
    this.plugins.push(new SrbfPlugin(material, this.asset, this.textures, this.frame, chosen));
    return material;
  }

  /**
   * Dim, recolor or switch a light of the scene: `intensity` 1 as designed, as all are at first, 0 off; `color` linear Rec.709. Call `update` after it.
   *
   * @throws SrbfError on a name that the asset does not have.
   */
  setNamedLight(name: string, intensity = 1, color: Triple = [1, 1, 1]): this {
    setNamedLight(this.asset, this.lights, name, intensity, color);
    return this;
  }

  /** Update the uniforms to the current lights. */
  update(): void {
    const values = frameValues(this.asset, this.lights);
    const room = pointLightRoom(values.pointLights.length);
    const changed = room !== this.frame.room;
    this.frame.weights = values.weights;
    this.frame.pointLights = packedPointLights(values.pointLights, room);
    this.frame.pointLightCount = values.pointLights.length;
    this.frame.room = room;
    this.frame.assetFromScene = new Float32Array(columnMajor(multiplied(this.asset.assetFromWorld, this.worldFromScene)));
    this.textures.weights?.update(values.weights);
    if (changed) for (const plugin of this.plugins) plugin.markAllDefinesAsDirty();
  }

  dispose(): void {
    this.textures.dispose();
  }
}
