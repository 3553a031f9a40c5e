// SPDX-License-Identifier: MIT
// An engine's material for coefficient maps under projected weights alone, whatever the lights are: its uniforms, and srbfRelit.
// SRBF_CLUSTERED: texels belong to clusters, whose components mean different things, so layers are never filtered: srbfSum and srbfRelit are
// the light of the texel that uv lies in, srbfRelitSurface with SRBF_FILTERED mixes the light of the four texels about it.
#include "methods/clustered_eigen_map.glsl"

uniform highp sampler2DArray srbfLayers;
uniform highp sampler2D srbfAmbient;
uniform highp sampler2D srbfWeights;
#ifdef SRBF_CLUSTERED
uniform highp sampler2D srbfClusters;
#endif
uniform vec4 srbfScale[SRBF_LAYERS];
uniform vec4 srbfBias[SRBF_LAYERS];

// Signed: before the clamp.
vec3 srbfSum(vec2 uv, float level, vec3 receiver) {
#ifdef SRBF_CLUSTERED
    ivec2 texel = ivec2(uv * vec2(textureSize(srbfLayers, 0).xy));
    return srbfClusteredDirectional(srbfLayers, srbfClusters, texel, 0, srbfWeights, srbfScale, srbfBias);
#else
    return srbfCombineComponentsDirectional(srbfLayers, uv, 0, srbfWeights, 0, srbfScale, srbfBias);
#endif
}

vec3 srbfRelit(vec2 uv, float level, vec3 receiver) {
    return srbfFinish(srbfSum(uv, level, receiver), textureLod(srbfAmbient, uv, 0.0).rgb);
}

// At a place on a surface.
vec3 srbfRelitSurface(vec2 uv, vec3 receiver) {
#if defined(SRBF_CLUSTERED) && defined(SRBF_FILTERED)
    vec3 sum = srbfClusteredDirectionalFiltered(srbfLayers, srbfClusters, uv, 0, srbfWeights, srbfScale, srbfBias);
    return srbfFinish(sum, textureLod(srbfAmbient, uv, 0.0).rgb);
#else
    return srbfRelit(uv, 0.0, receiver);
#endif
}
