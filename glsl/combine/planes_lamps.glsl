// SPDX-License-Identifier: MIT
/* srbfCombinePlanesLamps: w_0 plus the sum over scalars of a_j w_j, each w_j summed over all lights, each texel fetched once.
   use:    vec3 srbfCombinePlanesLamps(sampler2DArray planes, vec2 uv, float level, int firstLayer, sampler2D weights, int cluster,
                                       sampler2D wTable, int tableSize, vec4 scale[SRBF_LAYERS], vec4 bias[SRBF_LAYERS],
                                       vec4 directions[SRBF_LAMPS], vec4 colors[SRBF_LAMPS], int shining)
   domain: planes, weights and cluster as in srbfCombinePlanesDirectional, weights 0 where no directional or environment light shines;
           level: of mip maps, 0 without; wTable as in srbfCombinePlanesPoint; directions, colors, shining from srbfLampsAt; result
           signed
   twin:   srbf.methods.coefficient_maps.linear_response
   cite:   Sloan2003 */
#include "basis/octahedral_encode.glsl"
#include "basis/octahedral_mix.glsl"
#include "basis/octahedral_node.glsl"
#include "combine/decode_planes.glsl"

#ifndef SRBF_SCALARS
#error define SRBF_SCALARS: how many scalars a texel has
#endif
#ifndef SRBF_LAYERS
#define SRBF_LAYERS ((SRBF_SCALARS + 3) / 4)
#endif
#ifndef SRBF_LAMPS
#error define SRBF_LAMPS: how many lamps a pass takes at most
#endif

vec3 srbfCombinePlanesLamps(highp sampler2DArray planes, vec2 uv, float level, int firstLayer, highp sampler2D weights, int cluster,
                            highp sampler2D wTable, int tableSize, vec4 scale[SRBF_LAYERS], vec4 bias[SRBF_LAYERS],
                            vec4 directions[SRBF_LAMPS], vec4 colors[SRBF_LAMPS], int shining) {
    int first = cluster * (SRBF_SCALARS + 1);
    vec4 nodes[SRBF_LAMPS];
    vec3 sum = firstLayer == 0 ? texelFetch(weights, ivec2(0, cluster), 0).rgb : vec3(0.0);
    for (int l = 0; l < shining; ++l) {
        nodes[l] = srbfOctahedralNode(tableSize, srbfOctahedralEncode(directions[l].xyz));
        if (firstLayer == 0) {
            sum += colors[l].rgb * srbfOctahedralMix(wTable, tableSize, first, nodes[l]);
        }
    }
    for (int i = 0; i < SRBF_LAYERS; ++i) {
        vec4 scalars = srbfDecodePlanes(textureLod(planes, vec3(uv, float(firstLayer + i)), level), scale[i], bias[i]);
        // An unused channel is 0 and takes the last weight, since a fetch outside the texture may be anything.
        ivec4 j = min(4 * (firstLayer + i) + ivec4(1, 2, 3, 4), ivec4(SRBF_SCALARS));
        sum += scalars.x * texelFetch(weights, ivec2(j.x, cluster), 0).rgb;
        sum += scalars.y * texelFetch(weights, ivec2(j.y, cluster), 0).rgb;
        sum += scalars.z * texelFetch(weights, ivec2(j.z, cluster), 0).rgb;
        sum += scalars.w * texelFetch(weights, ivec2(j.w, cluster), 0).rgb;
        j += first;
        for (int l = 0; l < shining; ++l) {
            vec3 answer = scalars.x * srbfOctahedralMix(wTable, tableSize, j.x, nodes[l]);
            answer += scalars.y * srbfOctahedralMix(wTable, tableSize, j.y, nodes[l]);
            answer += scalars.z * srbfOctahedralMix(wTable, tableSize, j.z, nodes[l]);
            answer += scalars.w * srbfOctahedralMix(wTable, tableSize, j.w, nodes[l]);
            sum += colors[l].rgb * answer;
        }
    }
    return sum;
}
