// SPDX-License-Identifier: MIT
// An engine's material for deep framebuffers: its uniforms, and srbfRelit, the light of all lights. Clusters' numbers are never filtered: every
// function gives the light of the texel that uv lies in.
#include "combine/finish.glsl"
#include "methods/deep_framebuffer.glsl"

uniform highp sampler2DArray srbfLayers;   // neighbors: SRBF_LAYERS clusters, then SRBF_LOBE_LAYERS lobes, then SRBF_BEHIND_LAYERS clusters behind
uniform highp sampler2D srbfAmbient;
uniform highp sampler2D srbfWeights;      // irradiance of the clusters, and after their last row what lobes gather
uniform highp sampler2D srbfReflectance;  // albedo / pi, or one texel of 1
#ifdef SRBF_LOBE_LAYERS
uniform highp sampler2D srbfGlossy;       // reflectance of lobes / pi
#endif
#ifdef SRBF_BEHIND_LAYERS
uniform highp sampler2D srbfThrough;      // transmittance / pi
#endif

vec3 srbfSum(vec2 uv, float level, vec3 receiver) {
    ivec2 texel = ivec2(uv * vec2(textureSize(srbfLayers, 0).xy));
    vec3 reflected = texelFetch(srbfReflectance, min(texel, textureSize(srbfReflectance, 0) - 1), 0).rgb;
    vec3 sum = reflected * srbfNeighborLight(srbfLayers, 0, SRBF_LAYERS, srbfWeights, texel);
#ifdef SRBF_LOBE_LAYERS
    sum += texelFetch(srbfGlossy, texel, 0).rgb * srbfNeighborLight(srbfLayers, SRBF_LAYERS, SRBF_LOBE_LAYERS, srbfWeights, texel);
#endif
#ifdef SRBF_BEHIND_LAYERS
    sum += texelFetch(srbfThrough, texel, 0).rgb * srbfNeighborLight(srbfLayers, SRBF_BEHIND_FIRST, SRBF_BEHIND_LAYERS, srbfWeights, texel);
#endif
    return sum;
}

vec3 srbfRelit(vec2 uv, float level, vec3 receiver) {
    return srbfFinish(srbfSum(uv, level, receiver), textureLod(srbfAmbient, uv, 0.0).rgb);
}

// At a place on a surface.
vec3 srbfRelitSurface(vec2 uv, vec3 receiver) {
    return srbfRelit(uv, 0.0, receiver);
}
