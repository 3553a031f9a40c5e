// SPDX-License-Identifier: MIT
// An engine's material for clustered eigen maps: its uniforms, and srbfRelit, the light of all point and distant lights together.
// A component has another meaning in another cluster: srbfRelit is the light of the texel that uv lies in, for redrawing the lightmap, and
// level must be 0.
#include "combine/mip_level.glsl"
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

// At a place on a surface, at the mip level that fits the pixel.
vec3 srbfRelitSurface(vec2 uv, vec3 receiver) {
    vec2 place = uv * vec2(textureSize(srbfLayers, 0).xy);
    return srbfRelit(uv, srbfMipLevel(dFdx(place), dFdy(place)), receiver);
}
