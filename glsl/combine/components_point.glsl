// SPDX-License-Identifier: MIT
/* srbfCombineComponentsPoint: w_0(L) plus the sum over components of a_j w_j(L), L being this receiver's own light direction.
   use:    vec3 srbfCombineComponentsPoint(sampler2DArray planes, vec2 uv, int firstLayer, sampler2D wTable, int tableSize, int cluster,
                                       vec3 lightDirection, vec4 scale[SRBF_LAYERS], vec4 bias[SRBF_LAYERS])
   domain: layers firstLayer ... firstLayer + SRBF_LAYERS - 1 of planes, four components each, and w_0 with layer 0; wTable holds
           function j of a cluster in tile cluster * (SRBF_COMPONENTS + 1) + j; lightDirection of length 1, or 0 where the receiver
           coincides with the point light; result signed, for unit irradiance
   twin:   srbf.methods.linear_response
   cite:   Sloan2003 */
#include "basis/octahedral_encode.glsl"
#include "basis/octahedral_lookup.glsl"
#include "combine/decode_components.glsl"

#ifndef SRBF_COMPONENTS
#error define SRBF_COMPONENTS: components per texel
#endif
#ifndef SRBF_LAYERS
#define SRBF_LAYERS ((SRBF_COMPONENTS + 3) / 4)
#endif

vec3 srbfCombineComponentsPoint(highp sampler2DArray planes, vec2 uv, int firstLayer, highp sampler2D wTable, int tableSize, int cluster,
                            vec3 lightDirection, vec4 scale[SRBF_LAYERS], vec4 bias[SRBF_LAYERS]) {
    vec2 place = srbfOctahedralEncode(lightDirection);
    int first = cluster * (SRBF_COMPONENTS + 1);
    vec3 sum = firstLayer == 0 ? srbfOctahedralLookup(wTable, tableSize, first, place) : vec3(0.0);
    for (int i = 0; i < SRBF_LAYERS; ++i) {
        vec4 components = srbfDecodeComponents(textureLod(planes, vec3(uv, float(firstLayer + i)), 0.0), scale[i], bias[i]);
        // An unused channel is 0 and takes the last weight, since a fetch outside the texture may be anything.
        ivec4 j = first + min(4 * (firstLayer + i) + ivec4(1, 2, 3, 4), ivec4(SRBF_COMPONENTS));
        sum += components.x * srbfOctahedralLookup(wTable, tableSize, j.x, place);
        sum += components.y * srbfOctahedralLookup(wTable, tableSize, j.y, place);
        sum += components.z * srbfOctahedralLookup(wTable, tableSize, j.z, place);
        sum += components.w * srbfOctahedralLookup(wTable, tableSize, j.w, place);
    }
    return sum;
}
