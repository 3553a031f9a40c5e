// SPDX-License-Identifier: MIT
// An engine's material for neural maps: its uniforms, and srbfRelit, the light of all point and distant lights together.
// The light of a mean of codes is no mean of light, so layers are never filtered: srbfSum and srbfRelit are the light of the texel that uv
// lies in, srbfRelitSurface with SRBF_FILTERED mixes the light of the four texels about it. There are no mip levels.
#include "methods/neural_map.glsl"

uniform highp sampler2DArray srbfLayers;
uniform highp sampler2D srbfAmbient;
uniform highp sampler2D srbfWeights;  // of each light at infinity a column: its direction, its color, which is 0 after the last one
uniform vec4 srbfNetwork[SRBF_NETWORK];
uniform vec4 srbfScale[SRBF_LAYERS];
uniform vec4 srbfBias[SRBF_LAYERS];
uniform vec4 srbfPointLights[4 * SRBF_POINT_LIGHTS];
uniform int srbfPointLightCount;

// Signed: before the clamp.
vec3 srbfSum(vec2 uv, float level, vec3 receiver) {
    vec4 units[SRBF_UNIT_VECTORS];
    srbfNeuralCodes(srbfLayers, uv, level, srbfNetwork, srbfScale, srbfBias, units);
    vec3 sum = srbfNeuralMapPoints(units, srbfNetwork, receiver, srbfPointLights, srbfPointLightCount);
    for (int l = 0; l < textureSize(srbfWeights, 0).x; ++l) {
        vec3 color = texelFetch(srbfWeights, ivec2(l, 1), 0).rgb;
        if (color == vec3(0.0)) {
            break;
        }
        sum += color * srbfNeuralToward(units, texelFetch(srbfWeights, ivec2(l, 0), 0).xyz, srbfNetwork);
    }
    return sum;
}

vec3 srbfRelit(vec2 uv, float level, vec3 receiver) {
    return srbfFinish(srbfSum(uv, level, receiver), textureLod(srbfAmbient, uv, 0.0).rgb);
}

// At a place on a surface.
vec3 srbfRelitSurface(vec2 uv, vec3 receiver) {
#ifdef SRBF_FILTERED
    vec2 size = vec2(textureSize(srbfLayers, 0).xy);
    vec2 place = uv * size - 0.5;
    vec2 share = fract(place);
    vec3 sum = vec3(0.0);
    for (int i = 0; i < 4; ++i) {
        vec2 corner = vec2(i & 1, i >> 1);
        vec2 part = mix(1.0 - share, share, corner);
        sum += part.x * part.y * srbfSum((floor(place) + corner + 0.5) / size, 0.0, receiver);
    }
    return srbfFinish(sum, textureLod(srbfAmbient, uv, 0.0).rgb);
#else
    return srbfRelit(uv, 0.0, receiver);
#endif
}
