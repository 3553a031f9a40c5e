// SPDX-License-Identifier: MIT
/* srbfCombineComponentsPointLights: w_0 plus the sum over components of a_j w_j, each w_j summed over all lights, each texel fetched once.
   use:    vec3 srbfCombineComponentsPointLights(sampler2DArray planes, vec2 uv, float level, int firstLayer, sampler2D weights, int cluster,
                                       sampler2D wTable, int tableSize, vec4 scale[SRBF_LAYERS], vec4 bias[SRBF_LAYERS],
                                       vec4 directions[SRBF_POINT_LIGHTS], vec4 colors[SRBF_POINT_LIGHTS], int shining)
   domain: planes, weights and cluster as in srbfCombineComponentsDirectional, weights 0 where no directional or environment light shines;
           level: mip level, 0 without mip maps; wTable as in srbfCombineComponentsPoint; directions, colors, shining from
           srbfPointLightsAt; result signed
   twin:   srbf.methods.linear_response
   cite:   Sloan2003 */
#include "basis/octahedral_encode.glsl"
#include "basis/octahedral_mix.glsl"
#include "basis/octahedral_node.glsl"
#include "combine/decode_components.glsl"

#ifndef SRBF_COMPONENTS
#error define SRBF_COMPONENTS: components per texel
#endif
#ifndef SRBF_LAYERS
#define SRBF_LAYERS ((SRBF_COMPONENTS + 3) / 4)
#endif
#ifndef SRBF_POINT_LIGHTS
#error define SRBF_POINT_LIGHTS: how many point lights a pass takes at most
#endif

vec3 srbfCombineComponentsPointLights(highp sampler2DArray planes, vec2 uv, float level, int firstLayer, highp sampler2D weights, int cluster,
                            highp sampler2D wTable, int tableSize, vec4 scale[SRBF_LAYERS], vec4 bias[SRBF_LAYERS],
                            vec4 directions[SRBF_POINT_LIGHTS], vec4 colors[SRBF_POINT_LIGHTS], int shining) {
    int first = cluster * (SRBF_COMPONENTS + 1);
    vec4 nodes[SRBF_POINT_LIGHTS];
    vec3 sum = firstLayer == 0 ? texelFetch(weights, ivec2(0, cluster), 0).rgb : vec3(0.0);
    for (int l = 0; l < shining; ++l) {
        nodes[l] = srbfOctahedralNode(tableSize, srbfOctahedralEncode(directions[l].xyz));
        if (firstLayer == 0) {
            sum += colors[l].rgb * srbfOctahedralMix(wTable, tableSize, first, nodes[l]);
        }
    }
    for (int i = 0; i < SRBF_LAYERS; ++i) {
        vec4 components = srbfDecodeComponents(textureLod(planes, vec3(uv, float(firstLayer + i)), level), scale[i], bias[i]);
        // An unused channel is 0 and takes the last weight, since a fetch outside the texture may be anything.
        ivec4 j = min(4 * (firstLayer + i) + ivec4(1, 2, 3, 4), ivec4(SRBF_COMPONENTS));
        sum += components.x * texelFetch(weights, ivec2(j.x, cluster), 0).rgb;
        sum += components.y * texelFetch(weights, ivec2(j.y, cluster), 0).rgb;
        sum += components.z * texelFetch(weights, ivec2(j.z, cluster), 0).rgb;
        sum += components.w * texelFetch(weights, ivec2(j.w, cluster), 0).rgb;
        j += first;
        for (int l = 0; l < shining; ++l) {
            vec3 response = components.x * srbfOctahedralMix(wTable, tableSize, j.x, nodes[l]);
            response += components.y * srbfOctahedralMix(wTable, tableSize, j.y, nodes[l]);
            response += components.z * srbfOctahedralMix(wTable, tableSize, j.z, nodes[l]);
            response += components.w * srbfOctahedralMix(wTable, tableSize, j.w, nodes[l]);
            sum += colors[l].rgb * response;
        }
    }
    return sum;
}
