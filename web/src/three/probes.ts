/** An asset of probes in a three.js scene: the light on what moves between them. */
import type { Material, Matrix4, WebGLProgramParametersWithUniforms, WebGLRenderer } from "three";
import { type Asset, loadAsset, type LoadOptions } from "../asset";
import { probesOf } from "../probes";
import probeLight from "../shaders/probe_light.glsl";
import { checkLit, type MaterialOptions, onCompile, replaced } from "./material";
import { ProbeLight } from "./probe_light";
import { type RelightingMapOptions, SrbfRelightingMap } from "./relighting_map";

export type ProbesOptions = Pick<RelightingMapOptions, "weights" | "shadowSize" | "target" | "lightsOf">;

/** GLSL for your own shaders: `vec3 srbfProbeLit(vec3 place, vec3 normal)`, irradiance, both in the asset's frame; its uniforms are `SrbfProbes.lookup`. */
export const PROBE_SHADER: string = probeLight;

/**
 * Probes that light what moves. Lights as in `SrbfRelightingMap`, or with `lightsOf` those of another asset; `apply` for materials, `update` once per frame.
 */
export class SrbfProbes extends SrbfRelightingMap {
  private readonly light: ProbeLight;
  private lit = -1;

  /** @throws SrbfError on an asset of other receivers. */
  constructor(asset: Asset, { weights, shadowSize, target = "half", lightsOf }: ProbesOptions = {}) {
    const probes = probesOf(asset);
    super(asset, { source: "lightmap", filter: "nearest", weights, shadowSize, target, lightsOf });
    this.light = new ProbeLight(probes, this.facets, target);
  }

  /** Fetch the asset at `url` (a folder with asset.json). @throws what `loadAsset` and the constructor throw. */
  static override async load(url: string, options: ProbesOptions & LoadOptions = {}): Promise<SrbfProbes> {
    return new SrbfProbes(await loadAsset(url, options), options);
  }

  /** Uniforms of `PROBE_SHADER`, with the matrix `srbfProbesFromScene` from three's world to the asset's frame. */
  get lookup(): ProbeLight["uniforms"] {
    return this.light.uniforms;
  }

  /**
   * Light `material` by the probes around it, wherever its mesh is: irradiance at every pixel, by its normal. `direct` as in `SrbfRelightingMap.apply`.
   *
   * @throws SrbfError on a material of another kind than Standard, Physical, Lambert.
   */
  override apply<M extends Material>(material: M, options: Pick<MaterialOptions, "direct"> = {}): M {
    checkLit(material);
    const direct = this.directOf(options);
    return onCompile(material, `srbf probes ${direct}`, (shader) => patchShader(shader, this.lookup, direct === "asset"));
  }

  override update(renderer: WebGLRenderer): void {
    super.update(renderer);
    (this.lookup.srbfProbesFromScene.value as Matrix4).copy(this.assetFromScene());
    if (this.lit === this.drawings) return;
    this.light.draw(renderer);
    this.lit = this.drawings;
  }

  override dispose(): void {
    super.dispose();
    this.light.dispose();
  }
}

function patchShader(shader: WebGLProgramParametersWithUniforms, uniforms: ProbeLight["uniforms"], replaceDirect: boolean): void {
  Object.assign(shader.uniforms, uniforms);
  shader.vertexShader = replaced(shader.vertexShader, [
    ["#include <common>", "#include <common>\nuniform mat4 srbfProbesFromScene;\nvarying vec3 vSrbfProbed;"],
    [
      "#include <project_vertex>",
      `#include <project_vertex>
      vec4 srbfProbed = vec4(transformed, 1.0);
      #ifdef USE_BATCHING
      srbfProbed = batchingMatrix * srbfProbed;
      #endif
      #ifdef USE_INSTANCING
      srbfProbed = instanceMatrix * srbfProbed;
      #endif
      vSrbfProbed = (srbfProbesFromScene * (modelMatrix * srbfProbed)).xyz;`,
    ],
  ]);
  const facing = "normalize(mat3(srbfProbesFromScene) * (vec4(normal, 0.0) * viewMatrix).xyz)";
  shader.fragmentShader = replaced(shader.fragmentShader, [
    ["#include <common>", `#include <common>\nuniform mat4 srbfProbesFromScene;\nvarying vec3 vSrbfProbed;\n${PROBE_SHADER}`],
    ["#include <lights_fragment_begin>", `#include <lights_fragment_begin>${replaceDirect ? "\nreflectedLight.directDiffuse = vec3(0.0);" : ""}`],
    ["#include <lights_fragment_maps>", `#include <lights_fragment_maps>\nirradiance += srbfProbeLit(vSrbfProbed, ${facing});`],
  ]);
}
