/** An asset's light in a Babylon.js PBRMaterial, as a material plugin. */
import type { UniformBuffer } from "@babylonjs/core/Materials/uniformBuffer.js";
import type { MaterialDefines } from "@babylonjs/core/Materials/materialDefines.js";
import { MaterialPluginBase } from "@babylonjs/core/Materials/materialPluginBase.js";
import type { PBRMaterial } from "@babylonjs/core/Materials/PBR/pbrMaterial.js";
import { ShaderLanguage } from "@babylonjs/core/Materials/shaderLanguage.js";
import type { AbstractEngine } from "@babylonjs/core/Engines/abstractEngine.js";
import type { SubMesh } from "@babylonjs/core/Meshes/subMesh.js";
import type { Scene } from "@babylonjs/core/scene.js";
import type { Asset } from "../asset";
import { constantVectors, shaderBody, shaderDefines } from "../shader";
import type { BabylonTextures } from "./textures";

export interface PluginOptions {
  /** The UV set of the lightmap. */
  uv?: "uv" | "uv2";
  /** Where v is 0: `top` as glTF has it, `bottom` otherwise. */
  uvOrigin?: "top" | "bottom";
  /** Receivers' positions: `vertex`, from the mesh, or `map`, as the asset recorded them. */
  receivers?: "vertex" | "map";
  /** Who adds the direct diffuse light of the scene's lights. */
  direct?: "asset" | "engine";
}

/** Numbers that the plugins of an asset share. */
export interface SharedFrame {
  /** Whether layers are filtered between texels. */
  readonly filtered: boolean;
  weights: Float32Array;
  pointLights: Float32Array;
  pointLightCount: number;
  room: number;
  /** Column-major. */
  assetFromScene: Float32Array;
}

const UNIFORMS = ["srbfPointLights", "srbfPointLightCount", "srbfAssetFromScene"];

export class SrbfPlugin extends MaterialPluginBase {
  private readonly constants: Record<string, Float32Array>;

  constructor(
    material: PBRMaterial,
    private readonly asset: Asset,
    private readonly textures: BabylonTextures,
    readonly frame: SharedFrame,
    private readonly options: Required<PluginOptions>,
  ) {
    super(material, "Srbf", 200, { SRBF: true, ...shaderDefines(asset, 1, frame.filtered) }, false, false);
    this.constants = constantVectors(asset);
    this.registerForExtraEvents = true; // so that hardBindForSubMesh is called
    this._pluginManager._addPlugin(this); // asks for the code at once, so not in the base's constructor
    this._enable(true);
  }

  override getClassName(): string {
    return "SrbfPlugin";
  }

  override isCompatible(language: ShaderLanguage): boolean {
    return language === ShaderLanguage.GLSL;
  }

  override prepareDefines(defines: MaterialDefines): void {
    Object.assign(defines, shaderDefines(this.asset, this.frame.room, this.frame.filtered));
  }

  override getSamplers(samplers: string[]): void {
    samplers.push(...Object.keys(this.textures.samplers));
  }

  override getAttributes(attributes: string[]): void {
    if (!attributes.includes(this.options.uv)) attributes.push(this.options.uv);
  }

  override getUniforms() {
    const { integers, weights } = this.asset.tables;
    const own = [...Object.keys(this.constants), ...Object.keys(integers), ...(weights.kind === "uniform" ? ["srbfWeights"] : [])];
    return { externalUniforms: [...UNIFORMS, ...own] };
  }

  override hardBindForSubMesh(_buffer: UniformBuffer, _scene: Scene, _engine: AbstractEngine, subMesh: SubMesh): void {
    const { effect } = subMesh;
    if (!effect) return;
    for (const [name, texture] of Object.entries(this.textures.samplers)) effect.setTexture(name, texture);
    for (const [name, values] of Object.entries(this.constants)) effect.setFloatArray4(name, values);
    for (const [name, value] of Object.entries(this.asset.tables.integers)) effect.setInt(name, value);
    if (this.asset.tables.weights.kind === "uniform") effect.setFloatArray4("srbfWeights", this.frame.weights);
    effect.setFloatArray4("srbfPointLights", this.frame.pointLights);
    effect.setInt("srbfPointLightCount", this.frame.pointLightCount);
    effect.setMatrices("srbfAssetFromScene", this.frame.assetFromScene);
  }

  override getCustomCode(shaderType: string): Record<string, string> {
    const { uv, uvOrigin, receivers, direct } = this.options;
    if (shaderType === "vertex") {
      return {
        CUSTOM_VERTEX_DEFINITIONS: `#ifndef ${uv.toUpperCase().replace(/^UV$/, "UV1")}
attribute vec2 ${uv};
#endif
uniform mat4 srbfAssetFromScene;
varying vec2 vSrbfUv;
varying vec3 vSrbfReceiver;`,
        CUSTOM_VERTEX_MAIN_END: `vSrbfUv = ${uvOrigin === "top" ? uv : `vec2(${uv}.x, 1.0 - ${uv}.y)`};
vSrbfReceiver = (srbfAssetFromScene * worldPos).xyz;`,
      };
    }
    const mapped = "texelFetch(srbfPositions, ivec2(vSrbfUv * vec2(textureSize(srbfPositions, 0))), 0).xyz";
    const light = `srbfRelitSurface(vSrbfUv, ${receivers === "map" ? mapped : "vSrbfReceiver"})`;
    const added = `finalDiffuse ${direct === "asset" ? "=" : "+="} surfaceAlbedo * ${light} * 0.3183098861837907;`;
    return {
      CUSTOM_FRAGMENT_DEFINITIONS: `varying vec2 vSrbfUv;
varying vec3 vSrbfReceiver;
${receivers === "map" ? "uniform highp sampler2D srbfPositions;" : ""}
${this.asset.alpha ? "uniform sampler2D srbfAlpha;" : ""}
${shaderBody(this.asset)}`,
      ...(this.asset.alpha ? { CUSTOM_FRAGMENT_UPDATE_ALPHA: "alpha *= textureLod(srbfAlpha, vSrbfUv, 0.0).r;" } : {}),
      ...(this.asset.manifest.quantity === "irradiance"
        ? { CUSTOM_FRAGMENT_BEFORE_FINALCOLORCOMPOSITION: added }
        : { CUSTOM_FRAGMENT_BEFORE_FOG: `finalColor.rgb = ${light};` }),
    };
  }
}
