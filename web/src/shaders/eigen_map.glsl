// SPDX-License-Identifier: MIT
// What an engine's material says of eigen maps: its uniforms, and srbfRelit, the light of all lamps and far lights together.
#include "methods/eigen_map.glsl"

uniform highp sampler2DArray srbfLayers;
uniform highp sampler2D srbfAmbient;
uniform highp sampler2D srbfWeights;
uniform vec4 srbfScale[SRBF_LAYERS];
uniform vec4 srbfBias[SRBF_LAYERS];
#if SRBF_LAMPS > 0
uniform highp sampler2D srbfTable;
uniform int srbfTableSize;
uniform SrbfLamp srbfLamps[SRBF_LAMPS];
#endif

vec3 srbfRelit(vec2 uv, vec3 receiver) {
    vec3 sum = srbfEigenMapDirectional(srbfLayers, uv, 0, srbfWeights, srbfScale, srbfBias);
#if SRBF_LAMPS > 0
    for (int i = 0; i < SRBF_LAMPS; ++i) {
        sum += srbfEigenMapPoint(srbfLayers, uv, 0, srbfTable, srbfTableSize, srbfScale, srbfBias, receiver, srbfLamps[i]);
    }
#endif
    return srbfFinish(sum, textureLod(srbfAmbient, uv, 0.0).rgb);
}
