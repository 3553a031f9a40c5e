/** What the screen shows per texel, with direct light per pixel: the relit picture, a coefficient map, or the difference to the reference; exposure, tone, false color. */
import { Color, GLSL3, type IUniform, RawShaderMaterial, ShaderChunk, type Texture, Vector2, Vector4 } from "three";
import type { SrbfTextures } from "../src/three";
import { PIXEL_LIGHT, pixelUniforms } from "./pixel_light";
import type { State } from "./state";

export const VALUES = { picture: 0, reference: 1, difference: 2, map: 3, negative: 4 } as const;
export const COLORS = { linear: 0, agx: 1, aces: 2, magnitude: 3, signed: 4, negative: 5 } as const;

/** What texels show of a state and in which colors; `comparing`: with a reference. */
export function shownAs({ compare, show, tone }: State, comparing: boolean): { value: keyof typeof VALUES; color: keyof typeof COLORS } {
  const value = comparing && compare !== "slider" && compare !== "off" ? compare : show === "map" && !comparing ? "map" : "picture";
  if (value === "difference" || value === "map") return { value, color: "signed" };
  if (show === "false color") return { value, color: "magnitude" };
  return { value, color: show === "negative" && !comparing ? "negative" : tone };
}

export const BACKGROUND = new Color(0x0f1114);

const FRAGMENT = `precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;
${ShaderChunk.tonemapping_pars_fragment}
in vec2 vUv;
uniform sampler2D relit, negative, reference, ambient, coverage;
uniform sampler2DArray layers;
uniform vec4 layerScale, layerBias;
uniform int layer, channel, value, color;
uniform vec3 referenceColor;
uniform float split; // in pixels of the drawing buffer; left of it is the reference
uniform bool nearest;
uniform vec3 background; // linear, behind a view
uniform bool cutOut; // the background is left transparent
out vec4 shown;

vec2 place(ivec2 size) {
    return nearest ? (floor(vUv * vec2(size)) + 0.5) / vec2(size) : vUv;
}

#ifdef AT_VERTICES
in vec3 vRelit, vAmbient, vNegative, vReference;
in vec4 vStored;
#define AT(texels, vertex) vertex
#else
#define AT(texels, vertex) textureLod(texels, place(textureSize(texels, 0)), 0.0).rgb
#endif

#ifdef ON_MESH
uniform float texelShare;
${PIXEL_LIGHT}
vec3 relitAt() { return texelShare * AT(relit, vRelit) + directAt(); }
#else
vec3 relitAt() { return AT(relit, vRelit); }
#endif

float coverageAt() {
#if defined(DEVELOPED) || defined(AT_VERTICES)
    return 1.0;
#else
    return textureLod(coverage, place(textureSize(coverage, 0)), 0.0).r;
#endif
}

vec3 referenceAt() { return AT(reference, vReference) * referenceColor + AT(ambient, vAmbient); }

vec3 valueAt() {
    if (value == ${VALUES.reference} || gl_FragCoord.x < split) return referenceAt();
    if (value == ${VALUES.difference}) return relitAt() - referenceAt();
    if (value == ${VALUES.map}) {
#ifdef AT_VERTICES
        vec4 stored = vStored * layerScale + layerBias;
#else
        vec4 stored = textureLod(layers, vec3(place(textureSize(layers, 0).xy), float(layer)), 0.0) * layerScale + layerBias;
#endif
        return channel < 0 ? stored.rgb : vec3(stored[channel]);
    }
    return relitAt();
}

float luminance(vec3 c) { return dot(c, vec3(0.2126, 0.7152, 0.0722)); }

// A polynomial of degree five through Turbo [Mikhailov2019].
vec3 turbo(float x) {
    x = clamp(x, 0.0, 1.0);
    vec4 v4 = vec4(1.0, x, x * x, x * x * x);
    vec2 v2 = v4.zw * v4.z;
    return clamp(vec3(
        dot(v4, vec4(0.13572138, 4.61539260, -42.66032258, 132.13108234)) + dot(v2, vec2(-152.94239396, 59.28637943)),
        dot(v4, vec4(0.09140261, 2.19418839, 4.84296658, -14.18503333)) + dot(v2, vec2(4.27729857, 2.82956604)),
        dot(v4, vec4(0.10667330, 12.64194608, -60.58204836, 110.36276771)) + dot(v2, vec2(-89.90310912, 27.34824973))), 0.0, 1.0);
}

// Blue below 0, red above, dark between.
vec3 signedColor(float x) {
    float s = clamp(abs(x), 0.0, 1.0);
    vec3 end = x < 0.0 ? vec3(0.18, 0.50, 1.0) : vec3(1.0, 0.28, 0.16);
    vec3 light = x < 0.0 ? vec3(0.85, 0.94, 1.0) : vec3(1.0, 0.93, 0.80);
    return s < 0.5 ? mix(vec3(0.07, 0.075, 0.085), end, s * 2.0) : mix(end, light, s * 2.0 - 1.0);
}

vec3 srgb(vec3 c) {
    c = clamp(c, 0.0, 1.0);
    return mix(1.055 * pow(max(c, 0.0031308), vec3(1.0 / 2.4)) - 0.055, 12.92 * c, vec3(lessThanEqual(c, vec3(0.0031308))));
}

vec3 linear(vec3 c) {
    return mix(pow((c + 0.055) / 1.055, vec3(2.4)), c / 12.92, vec3(lessThanEqual(c, vec3(0.04045))));
}

void main() {
#ifdef DEVELOPED
    vec3 v = textureLod(relit, vUv, 0.0).rgb;
#else
    vec3 v = valueAt();
#endif
    vec3 c;
    if (color == ${COLORS.magnitude}) c = turbo(luminance(v) * toneMappingExposure);
    else if (color == ${COLORS.signed}) c = signedColor(luminance(v) * toneMappingExposure);
    else if (color == ${COLORS.negative}) {
        vec3 below = max(AT(negative, vNegative) - AT(ambient, vAmbient), 0.0);
        float depth = max(below.r, max(below.g, below.b)) * toneMappingExposure;
        vec3 gray = vec3(srgb(vec3(luminance(v) * toneMappingExposure)) * 0.55);
        c = depth > 0.0005 ? mix(vec3(0.35, 0.05, 0.42), vec3(1.0, 0.35, 1.0), clamp(depth * 8.0, 0.0, 1.0)) : gray;
    }
    else if (color == ${COLORS.agx}) c = srgb(AgXToneMapping(v));
    else if (color == ${COLORS.aces}) c = srgb(ACESFilmicToneMapping(v));
    else c = srgb(LinearToneMapping(v));
    float alpha = coverageAt();
    if (cutOut) shown = vec4(alpha > 0.0 ? c : vec3(0.0), alpha);
    else shown = vec4(alpha >= 1.0 ? c : srgb(mix(background, linear(c), alpha)), 1.0);
}`;

const MESH = `precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;
in vec3 position;
in vec2 lightmapUv;
uniform mat4 modelMatrix, viewMatrix, projectionMatrix, litFromScene;
out vec2 vUv;
out vec3 vPlace;
#ifdef AT_VERTICES
uniform sampler2D relit, ambient, negative, reference;
uniform sampler2DArray layers;
uniform int layer;
out vec3 vRelit, vAmbient, vNegative, vReference;
out vec4 vStored;
#endif
void main() {
    vUv = lightmapUv;
#ifdef AT_VERTICES
    vRelit = textureLod(relit, lightmapUv, 0.0).rgb;
    vAmbient = textureLod(ambient, lightmapUv, 0.0).rgb;
    vNegative = textureLod(negative, lightmapUv, 0.0).rgb;
    vReference = textureLod(reference, lightmapUv, 0.0).rgb;
    vStored = textureLod(layers, vec3(lightmapUv, float(layer)), 0.0);
#endif
    vec4 world = modelMatrix * vec4(position, 1.0);
    vPlace = (litFromScene * world).xyz;
    gl_Position = projectionMatrix * viewMatrix * world;
}`;

const PICTURE = `precision highp float;
in vec3 position;
uniform vec2 pictureScale, pictureOffset;
out vec2 vUv;
void main() {
    vUv = vec2(0.5 + 0.5 * position.x, 0.5 - 0.5 * position.y);
    gl_Position = vec4(position.xy * pictureScale + pictureOffset, 1.0, 1.0);
}`;

const WHOLE = `precision highp float;
in vec3 position;
out vec2 vUv;
void main() {
    vUv = 0.5 + 0.5 * position.xy;
    gl_Position = vec4(position.xy, 1.0, 1.0);
}`;

export type ScreenUniforms = Record<string, IUniform> & ReturnType<typeof pixelUniforms> & { negative: IUniform<Texture | null>; reference: IUniform<Texture | null> };

/** `coverage`: alpha of a view; 1 everywhere for other assets. */
export function screenUniforms(relit: Texture, textures: SrbfTextures, coverage: Texture): ScreenUniforms {
  return {
    relit: { value: relit },
    negative: { value: textures.ambient },
    reference: { value: textures.ambient },
    ambient: { value: textures.ambient },
    coverage: { value: coverage },
    background: { value: BACKGROUND },
    cutOut: { value: false },
    layers: { value: textures.layers },
    layerScale: { value: new Vector4(1, 1, 1, 1) },
    layerBias: { value: new Vector4() },
    layer: { value: 0 },
    channel: { value: -1 },
    value: { value: 0 },
    color: { value: 0 },
    referenceColor: { value: [1, 1, 1] },
    split: { value: 0 },
    nearest: { value: false },
    toneMappingExposure: { value: 1 },
    pictureScale: { value: new Vector2(1, 1) },
    pictureOffset: { value: new Vector2(0, 0) },
    ...pixelUniforms(),
  };
}

const SHADERS = { mesh: MESH, vertices: MESH, picture: PICTURE, screen: WHOLE };
const DEFINES = { mesh: { ON_MESH: "" }, vertices: { ON_MESH: "", AT_VERTICES: "" }, picture: {}, screen: { DEVELOPED: "" } };

/** Onto a `mesh`, one that has light at its `vertices` alone, a `picture` of texels, or the whole `screen`, where `relit` is of pixels, row 0 at the bottom. */
export function screenMaterial(uniforms: ScreenUniforms, onto: keyof typeof SHADERS): RawShaderMaterial {
  const inScene = onto === "mesh" || onto === "vertices";
  return new RawShaderMaterial({
    glslVersion: GLSL3,
    defines: { ...DEFINES[onto] },
    uniforms,
    vertexShader: SHADERS[onto],
    fragmentShader: FRAGMENT,
    depthTest: inScene,
    depthWrite: inScene,
    side: 2,
    toneMapped: false,
  });
}
