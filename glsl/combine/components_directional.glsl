// SPDX-License-Identifier: MIT
/* srbfCombineComponentsDirectional: w_0 plus the sum over components of a_j w_j, the weights equal for all receivers of a cluster.
   use:    vec3 srbfCombineComponentsDirectional(sampler2DArray planes, vec2 uv, int firstLayer, sampler2D weights, int cluster,
                                             vec4 scale[SRBF_LAYERS], vec4 bias[SRBF_LAYERS])
   domain: layers firstLayer ... firstLayer + SRBF_LAYERS - 1 of planes, four components each, and w_0 with layer 0; weights: texel
           (j, cluster) holds w_j times the lights' colors, summed over all directional and environment lights, RGBA32F of
           width SRBF_COMPONENTS + 1; result signed, before the clamp
   twin:   srbf.methods.linear_response
   cite:   Sloan2003 */
#include "combine/decode_components.glsl"

#ifndef SRBF_COMPONENTS
#error define SRBF_COMPONENTS: components per texel
#endif
#ifndef SRBF_LAYERS
#define SRBF_LAYERS ((SRBF_COMPONENTS + 3) / 4)
#endif

vec3 srbfCombineComponentsDirectional(highp sampler2DArray planes, vec2 uv, int firstLayer, highp sampler2D weights, int cluster,
                                  vec4 scale[SRBF_LAYERS], vec4 bias[SRBF_LAYERS]) {
    vec3 sum = firstLayer == 0 ? texelFetch(weights, ivec2(0, cluster), 0).rgb : vec3(0.0);
    for (int i = 0; i < SRBF_LAYERS; ++i) {
        vec4 components = srbfDecodeComponents(textureLod(planes, vec3(uv, float(firstLayer + i)), 0.0), scale[i], bias[i]);
        // An unused channel is 0 and takes the last weight, since a fetch outside the texture may be anything.
        ivec4 j = min(4 * (firstLayer + i) + ivec4(1, 2, 3, 4), ivec4(SRBF_COMPONENTS));
        sum += components.x * texelFetch(weights, ivec2(j.x, cluster), 0).rgb;
        sum += components.y * texelFetch(weights, ivec2(j.y, cluster), 0).rgb;
        sum += components.z * texelFetch(weights, ivec2(j.z, cluster), 0).rgb;
        sum += components.w * texelFetch(weights, ivec2(j.w, cluster), 0).rgb;
    }
    return sum;
}
