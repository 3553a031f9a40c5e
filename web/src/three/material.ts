/** An asset's light in three.js's own materials, by onBeforeCompile. */
import type { Material, WebGLProgramParametersWithUniforms } from "three";
import type { Asset } from "../asset";
import { SrbfError } from "../errors";
import { shaderText } from "../shader";
import type { Uniforms } from "./uniforms";

export interface MaterialOptions {
  /** Which UV set the lightmap has: attribute uv, uv1, uv2, uv3 of the geometry. */
  channel?: 0 | 1 | 2 | 3;
  /** Where v is 0: `top` as glTF has it, `bottom` as three's own geometries do. */
  uvOrigin?: "top" | "bottom";
  /** Receivers' positions: `vertex`, from the mesh in the scene, or `map`, as the asset recorded them; only point and spot lights need them. */
  receivers?: "vertex" | "map";
  /**
   * Who adds the direct diffuse light of the scene's lights: the `asset`, whose light then replaces three's, or the `engine`. Assets of combined
   * transport hold it, indirect ones do not.
   */
  direct?: "asset" | "engine";
}

export interface Patch {
  asset: Asset;
  uniforms: Uniforms;
  /** `maps`: the layers are summed in the material; `lightmap`: a lightmap that `update` has drawn is sampled. */
  source: "maps" | "lightmap";
  /** How many point lights the program has room for. */
  room: number;
  options: Required<MaterialOptions>;
}

const LIT = ["MeshStandardMaterial", "MeshPhysicalMaterial", "MeshLambertMaterial"];

const CUT_OUT: [string, string] = ["#include <opaque_fragment>", "diffuseColor.a *= textureLod(srbfAlpha, vSrbfUv, 0.0).r;\n#include <opaque_fragment>"];

/** @throws SrbfError on a material that has no diffuse light by normals: none of three's Standard, Physical or Lambert. */
export function checkLit(material: Material): void {
  if (!LIT.includes(material.type)) throw new SrbfError(`expected a material of ${LIT.join(", ")} for probes, found ${material.type}; use PROBE_SHADER in it yourself`);
}

/** Call `patch` when `material` is compiled, after what its own onBeforeCompile does; `key` is the same for patches that give the same shader. */
export function onCompile<M extends Material>(material: M, key: string | (() => string), patch: (shader: WebGLProgramParametersWithUniforms) => void): M {
  const before = material.onBeforeCompile;
  const keyBefore = material.customProgramCacheKey;
  material.onBeforeCompile = (shader, renderer) => {
    before.call(material, shader, renderer);
    patch(shader);
  };
  material.customProgramCacheKey = () => `${keyBefore.call(material)} ${typeof key === "string" ? key : key()}`;
  material.needsUpdate = true;
  return material;
}

/** @throws SrbfError on a material that is none of three's Standard, Physical, Lambert or Basic. */
export function checkMaterial(material: Material): void {
  if (![...LIT, "MeshBasicMaterial"].includes(material.type)) {
    throw new SrbfError(`expected a material of ${LIT.join(", ")} or MeshBasicMaterial, found ${material.type}; sample the lightmap's texture yourself`);
  }
}

/** Equal for patches that share a program. */
export function patchKey(patch: Patch): string {
  const { asset, source, room, options } = patch;
  return ["srbf", asset.manifest.method, asset.manifest.quantity, asset.layers.count, asset.alpha !== undefined, source, room, ...Object.values(options)].join(" ");
}

/** Irradiance adds to a material's as a lightMap does (outgoing = albedo * E / pi); radiance replaces its outgoing light. */
export function patchShader(shader: WebGLProgramParametersWithUniforms, material: Material, patch: Patch): void {
  const { asset, uniforms, source, options } = patch;
  Object.assign(shader.uniforms, uniforms);
  const attribute = options.channel === 0 ? "uv" : `uv${options.channel}`;
  const declared = options.channel === 0 ? "" : `#ifndef USE_UV${options.channel}\nattribute vec2 ${attribute};\n#endif\n`;
  const place = options.uvOrigin === "top" ? attribute : `vec2(${attribute}.x, 1.0 - ${attribute}.y)`;
  shader.vertexShader = replaced(shader.vertexShader, [
    ["#include <common>", `#include <common>\n${declared}uniform mat4 srbfAssetFromScene;\nvarying vec2 vSrbfUv;\nvarying vec3 vSrbfReceiver;`],
    [
      "#include <project_vertex>",
      `#include <project_vertex>
      vec4 srbfPlace = vec4(transformed, 1.0);
      #ifdef USE_BATCHING
      srbfPlace = batchingMatrix * srbfPlace;
      #endif
      #ifdef USE_INSTANCING
      srbfPlace = instanceMatrix * srbfPlace;
      #endif
      vSrbfReceiver = (srbfAssetFromScene * (modelMatrix * srbfPlace)).xyz;
      vSrbfUv = ${place};`,
    ],
  ]);
  const light = source === "maps" ? `srbfRelitSurface(vSrbfUv, ${receiver(options)})` : "texture(srbfLightmap, vSrbfUv).rgb";
  const declarations = ["varying vec2 vSrbfUv;", "varying vec3 vSrbfReceiver;"];
  declarations.push(source === "maps" ? shaderText(asset, patch.room) : "uniform sampler2D srbfLightmap;");
  if (source === "maps" && options.receivers === "map") declarations.push("uniform highp sampler2D srbfPositions;");
  if (asset.alpha) declarations.push("uniform sampler2D srbfAlpha;");
  shader.fragmentShader = replaced(shader.fragmentShader, [
    ["#include <common>", `#include <common>\n${declarations.join("\n")}`],
    ...additions(asset, material, options, light),
    ...(asset.alpha ? [CUT_OUT] : []),
  ]);
}

function additions(asset: Asset, material: Material, options: Required<MaterialOptions>, light: string): [string, string][] {
  if (asset.manifest.quantity === "radiance") return [["#include <opaque_fragment>", `outgoingLight = ${light};\n#include <opaque_fragment>`]];
  if (material.type === "MeshBasicMaterial") {
    return [["#include <aomap_fragment>", `reflectedLight.indirectDiffuse = ${light} * RECIPROCAL_PI;\n#include <aomap_fragment>`]];
  }
  const dropped = options.direct === "asset" ? "\nreflectedLight.directDiffuse = vec3(0.0);" : "";
  return [
    ["#include <lights_fragment_begin>", `#include <lights_fragment_begin>${dropped}`],
    ["#include <lights_fragment_maps>", `#include <lights_fragment_maps>\nirradiance += ${light};`],
  ];
}

function receiver(options: Required<MaterialOptions>): string {
  if (options.receivers === "vertex") return "vSrbfReceiver";
  return "texelFetch(srbfPositions, clamp(ivec2(vSrbfUv * vec2(textureSize(srbfPositions, 0))), ivec2(0), textureSize(srbfPositions, 0) - 1), 0).xyz";
}

/** Every first of the pairs in its place by the second. @throws SrbfError where three's shader lacks one. */
export function replaced(text: string, pairs: [string, string][]): string {
  return pairs.reduce((out, [chunk, by]) => {
    if (!out.includes(chunk)) throw new SrbfError(`expected ${chunk} in three's shader, found none; this release of three.js is not supported`);
    return out.replace(chunk, () => by);
  }, text);
}
