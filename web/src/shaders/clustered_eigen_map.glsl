// SPDX-License-Identifier: MIT
// Clustered eigen maps: uniforms, and srbfRelit at a texel's centre. A scalar means something else in the next cluster, so this is for drawing the
// lightmap anew, never for a place between texels.
#include "methods/clustered_eigen_map.glsl"

uniform highp sampler2DArray srbfLayers;
uniform highp sampler2D srbfAmbient;
uniform highp sampler2D srbfClusters;
uniform highp sampler2D srbfWeights;
uniform vec4 srbfScale[SRBF_LAYERS];
uniform vec4 srbfBias[SRBF_LAYERS];
#if SRBF_LAMPS > 0
uniform highp sampler2D srbfTable;
uniform int srbfTableSize;
uniform SrbfLamp srbfLamps[SRBF_LAMPS];
#endif

vec3 srbfRelit(vec2 uv, vec3 receiver) {
    ivec2 texel = ivec2(uv * vec2(textureSize(srbfLayers, 0).xy));
    vec3 sum = srbfClusteredDirectional(srbfLayers, srbfClusters, texel, 0, srbfWeights, srbfScale, srbfBias);
#if SRBF_LAMPS > 0
    for (int i = 0; i < SRBF_LAMPS; ++i) {
        sum += srbfClusteredPoint(srbfLayers, srbfClusters, texel, 0, srbfTable, srbfTableSize, srbfScale, srbfBias, receiver, srbfLamps[i]);
    }
#endif
    return srbfFinish(sum, textureLod(srbfAmbient, uv, 0.0).rgb);
}
