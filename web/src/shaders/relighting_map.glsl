// SPDX-License-Identifier: MIT
// What an engine's material says of relighting maps: its uniforms, and srbfRelit, the light of all lamps and far lights together.
#include "methods/relighting_map.glsl"

uniform highp sampler2DArray srbfLayers;
uniform highp sampler2D srbfAmbient;
uniform vec4 srbfWeights[SRBF_K];
uniform vec4 srbfScale[SRBF_K];
uniform vec4 srbfBias[SRBF_K];
#if SRBF_LAMPS > 0
uniform highp sampler2D srbfTable;
uniform vec4 srbfCenters[SRBF_K];
uniform SrbfLamp srbfLamps[SRBF_LAMPS];
#endif

vec3 srbfRelit(vec2 uv, vec3 receiver) {
    vec3 sum = srbfRelightDirectional(srbfLayers, uv, 0, srbfWeights, srbfScale, srbfBias);
#if SRBF_LAMPS > 0
    for (int i = 0; i < SRBF_LAMPS; ++i) {
        sum += srbfRelightPoint(srbfLayers, uv, 0, srbfTable, srbfCenters, srbfScale, srbfBias, receiver, srbfLamps[i]);
    }
#endif
    return srbfFinish(sum, textureLod(srbfAmbient, uv, 0.0).rgb);
}
