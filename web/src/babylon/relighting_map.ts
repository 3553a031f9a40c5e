/** An asset in a Babylon.js scene: its textures, its lights, the materials that it lights. */
import { PBRMaterial } from "@babylonjs/core/Materials/PBR/pbrMaterial.js";
import type { Scene } from "@babylonjs/core/scene.js";
import { type Asset, loadAsset, type LoadOptions } from "../asset";
import { pointLightRoom, packedPointLights } from "../point_light";
import type { Light } from "../lights";
import { receiversFrom } from "../manifest";
import { columnMajor, type Matrix4, multiplied, Z_UP_FROM_Y_UP } from "../matrix";
import { frameValues, needFilterable, needPositions } from "../shader";
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

  /** @throws SrbfError on layers that must not be filtered (clustered eigen maps), and on block-compressed ones. */
  constructor(
    readonly asset: Asset,
    scene: Scene,
    options: { filter?: "linear" | "nearest" } = {},
  ) {
    needFilterable(asset, "Babylon.js");
    this.worldFromScene = scene.useRightHandedSystem ? Z_UP_FROM_Y_UP : Z_UP_FROM_LEFT_HANDED;
    this.textures = new BabylonTextures(asset, scene, options.filter ?? "linear");
    this.frame = { weights: new Float32Array(0), pointLights: new Float32Array(16), pointLightCount: 0, room: 1, assetFromScene: new Float32Array(16) };
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
