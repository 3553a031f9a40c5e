// SPDX-License-Identifier: MIT
/* srbfCombineComponentsProjectedCluster: the same for a cluster, whose offset and weights are a row of a texture.
   use:    vec3 srbfCombineComponentsProjectedCluster(sampler2DArray planes, vec2 uv, int firstLayer, sampler2D weights, int cluster)
   domain: weights: RGBA32F, nearest, 3 (all layers) + 1 texels wide, one row per cluster: the offset, then three texels per layer, the red,
           green and blue weights of its four components, each w_j times the channel's scale; the offset counts with firstLayer 0; result
           signed, before the clamp
   twin:   srbf.methods.linear_response
   cite:   Sloan2003 */
#ifndef SRBF_COMPONENTS
#error define SRBF_COMPONENTS: components per texel
#endif
#ifndef SRBF_LAYERS
#define SRBF_LAYERS ((SRBF_COMPONENTS + 3) / 4)
#endif

vec3 srbfCombineComponentsProjectedCluster(highp sampler2DArray planes, vec2 uv, int firstLayer, highp sampler2D weights, int cluster) {
    vec3 sum = firstLayer == 0 ? texelFetch(weights, ivec2(0, cluster), 0).rgb : vec3(0.0);
    for (int i = 0; i < SRBF_LAYERS; ++i) {
        vec4 stored = textureLod(planes, vec3(uv, float(firstLayer + i)), 0.0);
        ivec2 at = ivec2(3 * (firstLayer + i) + 1, cluster);
        vec4 red = texelFetch(weights, at, 0);
        vec4 green = texelFetch(weights, at + ivec2(1, 0), 0);
        vec4 blue = texelFetch(weights, at + ivec2(2, 0), 0);
        sum += vec3(dot(stored, red), dot(stored, green), dot(stored, blue));
    }
    return sum;
}
