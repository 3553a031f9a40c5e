// SPDX-License-Identifier: MIT
// An engine's material for clustered eigen maps: its uniforms, and srbfRelit, the light of all point and distant lights together.
// A component has another meaning in another cluster, so layers are never filtered: srbfSum and srbfRelit are the light of the texel that uv
// lies in, srbfRelitSurface with SRBF_FILTERED mixes the light of the four texels about it. There are no mip levels.
#include "methods/clustered_eigen_map_lights.glsl"

uniform highp sampler2DArray srbfLayers;
uniform highp sampler2D srbfAmbient;
uniform highp sampler2D srbfTable;
uniform highp sampler2D srbfWeights;
uniform highp sampler2D srbfClusters;
uniform int srbfTableSize;
uniform vec4 srbfScale[SRBF_LAYERS];
uniform vec4 srbfBias[SRBF_LAYERS];
uniform vec4 srbfPointLights[4 * SRBF_POINT_LIGHTS];
uniform int srbfPointLightCount;

// Signed: before the clamp.
vec3 srbfSum(vec2 uv, float level, vec3 receiver) {
    ivec2 texel = ivec2(uv * vec2(textureSize(srbfLayers, 0).xy));
    return srbfClusteredLights(srbfLayers, srbfClusters, texel, 0, srbfWeights, srbfTable, srbfTableSize, srbfScale, srbfBias, receiver,
                               srbfPointLights, srbfPointLightCount);
}

vec3 srbfRelit(vec2 uv, float level, vec3 receiver) {
    return srbfFinish(srbfSum(uv, level, receiver), textureLod(srbfAmbient, uv, 0.0).rgb);
}

// At a place on a surface.
vec3 srbfRelitSurface(vec2 uv, vec3 receiver) {
#ifdef SRBF_FILTERED
    vec3 sum = srbfClusteredLightsFiltered(srbfLayers, srbfClusters, uv, 0, srbfWeights, srbfTable, srbfTableSize, srbfScale, srbfBias,
                                           receiver, srbfPointLights, srbfPointLightCount);
    return srbfFinish(sum, textureLod(srbfAmbient, uv, 0.0).rgb);
#else
    return srbfRelit(uv, 0.0, receiver);
#endif
}
