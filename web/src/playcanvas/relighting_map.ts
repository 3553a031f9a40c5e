/** An asset in a PlayCanvas scene: its textures, its lights, the materials that show it. */
import { BLEND_NORMAL, type GraphicsDevice, SEMANTIC_POSITION, SEMANTIC_TEXCOORD0, SEMANTIC_TEXCOORD1, ShaderMaterial } from "playcanvas";
import { type Asset, loadAsset, type LoadOptions } from "../asset";
import { pointLightRoom, packedPointLights } from "../point_light";
import type { Light } from "../lights";
import { receiversFrom } from "../manifest";
import { asDesigned, setNamedLight } from "../named_lights";
import { columnMajor, type Matrix4, multiplied, type Triple, Z_UP_FROM_Y_UP } from "../matrix";
import { constantVectors, frameValues, needPositions } from "../shader";
import { fragmentText, type ShaderOptions, vertexText } from "./shader";
import { PlayCanvasTextures } from "./textures";

export interface ShowOptions extends Partial<ShaderOptions> {
  /** The UV set of the lightmap. */
  channel?: 0 | 1;
  /** Linear reflectance of the surface, for irradiance assets. */
  albedo?: Triple;
}

interface Shown {
  material: ShaderMaterial;
  options: ShaderOptions & { channel: 0 | 1 };
}

/** An asset that PlayCanvas shows under WebGL2 with its own materials. Set `lights`, call `update` after every change, and `dispose` at the end. */
export class SrbfRelightingMap {
  /** In the asset's world: Blender's, z up, meters. */
  readonly lights: Light[] = [];
  /** Blender's world from the scene's; where meshes of the asset were moved, with the inverse of that. */
  worldFromScene: Matrix4 = Z_UP_FROM_Y_UP;
  readonly textures: PlayCanvasTextures;
  private readonly shown: Shown[] = [];
  private readonly filtered: boolean;
  private room = 1;

  /** `filter` of the layers; clusters are mixed in the shader, from four texels each. @throws SrbfError on block-compressed layers. */
  constructor(
    readonly asset: Asset,
    device: GraphicsDevice,
    options: { filter?: "linear" | "nearest" } = {},
  ) {
    this.lights.push(...asDesigned(asset));
    const filter = options.filter ?? "linear";
    this.filtered = filter === "linear";
    this.textures = new PlayCanvasTextures(asset, device, filter);
  }

  /** Fetch the asset at `url` (a folder with asset.json). @throws what `loadAsset` and the constructor throw. */
  static async load(url: string, device: GraphicsDevice, options: { filter?: "linear" | "nearest" } & LoadOptions = {}): Promise<SrbfRelightingMap> {
    return new SrbfRelightingMap(await loadAsset(url, options), device, options);
  }

  /** A material that shows only this asset, without the scene's lights, fog or skins; tone mapped and encoded for the camera. */
  material(options: ShowOptions = {}): ShaderMaterial {
    const receivers = options.receivers ?? receiversFrom(this.asset.manifest);
    if (receivers === "map") needPositions(this.asset, 1);
    const shown: Shown = {
      material: new ShaderMaterial(),
      options: { receivers, uvOrigin: options.uvOrigin ?? "top", channel: options.channel ?? 1 },
    };
    const { material } = shown;
    if (this.asset.alpha) material.blendType = BLEND_NORMAL;
    for (const [name, texture] of Object.entries(this.textures.samplers)) material.setParameter(name, texture);
    material.setParameter("srbfAlbedo", [...(options.albedo ?? [1, 1, 1])]);
    for (const [name, values] of Object.entries(constantVectors(this.asset))) material.setParameter(`${name}[0]`, values);
    for (const [name, value] of Object.entries(this.asset.tables.integers)) material.setParameter(name, value);
    this.shown.push(shown);
    this.compile(shown);
    this.update();
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

  /** Update the materials to the current lights. */
  update(): void {
    const values = frameValues(this.asset, this.lights);
    const room = pointLightRoom(values.pointLights.length);
    if (room !== this.room) {
      this.room = room;
      for (const shown of this.shown) this.compile(shown);
    }
    const assetFromScene = new Float32Array(columnMajor(multiplied(this.asset.assetFromWorld, this.worldFromScene)));
    if (this.textures.weights) {
      (this.textures.weights.lock() as Float32Array).set(values.weights);
      this.textures.weights.unlock();
    }
    for (const { material } of this.shown) {
      if (this.asset.tables.weights.kind === "uniform") material.setParameter("srbfWeights[0]", values.weights);
      material.setParameter("srbfPointLights[0]", packedPointLights(values.pointLights, room));
      material.setParameter("srbfPointLightCount", values.pointLights.length);
      material.setParameter("srbfAssetFromScene", assetFromScene);
    }
  }

  dispose(): void {
    this.textures.dispose();
  }

  private compile({ material, options }: Shown): void {
    const { manifest, layers } = this.asset;
    material.shaderDesc = {
      uniqueName: `srbf ${manifest.method} ${manifest.quantity} ${layers.count} ${this.asset.alpha !== undefined} ${this.filtered} ${this.room} ${Object.values(options).join(" ")}`,
      attributes: { aPosition: SEMANTIC_POSITION, aLightmapUv: options.channel === 0 ? SEMANTIC_TEXCOORD0 : SEMANTIC_TEXCOORD1 },
      vertexGLSL: vertexText(options),
      fragmentGLSL: fragmentText(this.asset, this.room, this.filtered, options),
    };
    material.update();
  }
}
