// SPDX-License-Identifier: MIT
// An engine's material for one map per named light: its uniforms, and srbfRelit, the light of all of them.
#include "combine/finish.glsl"
#include "combine/mip_level.glsl"
#include "combine/weighted.glsl"

uniform highp sampler2DArray srbfLayers;
uniform highp sampler2D srbfAmbient;
uniform highp sampler2D srbfWeights;
uniform vec4 srbfScale[SRBF_K];
uniform vec4 srbfBias[SRBF_K];

// Signed: before the clamp.
vec3 srbfSum(vec2 uv, float level, vec3 receiver) {
    return srbfCombineWeighted(srbfLayers, uv, level, 0, srbfWeights, srbfScale, srbfBias);
}

vec3 srbfRelit(vec2 uv, float level, vec3 receiver) {
    return srbfFinish(srbfSum(uv, level, receiver), textureLod(srbfAmbient, uv, 0.0).rgb);
}

// At a place on a surface, at the mip level that fits the pixel.
vec3 srbfRelitSurface(vec2 uv, vec3 receiver) {
    vec2 place = uv * vec2(textureSize(srbfLayers, 0).xy);
    return srbfRelit(uv, srbfMipLevel(dFdx(place), dFdy(place)), receiver);
}
