/** The shader of a PlayCanvas ShaderMaterial that shows an asset. */
import type { Asset } from "../asset";
import { shaderText } from "../shader";

export interface ShaderOptions {
  /** Where v is 0: `top` as glTF has it, `bottom` otherwise. */
  uvOrigin: "top" | "bottom";
  /** Receivers' positions: `vertex`, from the mesh, or `map`, as the asset recorded them. */
  receivers: "vertex" | "map";
}

export function vertexText({ uvOrigin }: ShaderOptions): string {
  return `attribute vec3 aPosition;
attribute vec2 aLightmapUv;
uniform mat4 matrix_model;
uniform mat4 matrix_viewProjection;
uniform mat4 srbfAssetFromScene;
varying vec2 vSrbfUv;
varying vec3 vSrbfReceiver;
void main(void) {
    vec4 place = matrix_model * vec4(aPosition, 1.0);
    vSrbfReceiver = (srbfAssetFromScene * place).xyz;
    vSrbfUv = ${uvOrigin === "top" ? "aLightmapUv" : "vec2(aLightmapUv.x, 1.0 - aLightmapUv.y)"};
    gl_Position = matrix_viewProjection * place;
}`;
}

/** Outgoing light: albedo times irradiance over pi, or radiance. */
export function fragmentText(asset: Asset, room: number, filtered: boolean, { receivers }: ShaderOptions): string {
  // The engine reads the sizes of uniform arrays itself, and knows no products.
  const mapped = "texelFetch(srbfPositions, ivec2(vSrbfUv * vec2(textureSize(srbfPositions, 0))), 0).xyz";
  const light = `srbfRelitSurface(vSrbfUv, ${receivers === "map" ? mapped : "vSrbfReceiver"})`;
  return `#include "gammaPS"
#include "tonemappingPS"
varying vec2 vSrbfUv;
varying vec3 vSrbfReceiver;
uniform vec3 srbfAlbedo;
${receivers === "map" ? "uniform highp sampler2D srbfPositions;" : ""}
${asset.alpha ? "uniform sampler2D srbfAlpha;" : ""}
${shaderText(asset, room, filtered).replaceAll("4 * SRBF_POINT_LIGHTS", String(4 * room))}
void main(void) {
    vec3 outgoing = ${asset.manifest.quantity === "irradiance" ? `srbfAlbedo * ${light} * 0.3183098861837907` : light};
    gl_FragColor = vec4(gammaCorrectOutput(toneMap(outgoing)), ${asset.alpha ? "textureLod(srbfAlpha, vSrbfUv, 0.0).r" : "1.0"});
}`;
}
