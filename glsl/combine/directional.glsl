// SPDX-License-Identifier: MIT
/* srbfCombineDirectional: sum over SRBF_K maps of weight times coefficient, the weights equal for all receivers.
   use:    vec3 srbfCombineDirectional(sampler2DArray maps, vec2 uv, int firstMap,
                                       vec4 weights[SRBF_K], vec4 scale[SRBF_K], vec4 bias[SRBF_K])
   domain: layers firstMap ... firstMap + SRBF_K - 1 of maps; weights.rgb the lights' colors times R_i(L), summed over all
           directional and environment lights; result signed, before the clamp
   twin:   srbf.methods.linear_response
   cite:   Wong2005, fig. 6 */
#include "combine/decode.glsl"

#ifndef SRBF_K
#error define SRBF_K: how many maps this pass combines
#endif

vec3 srbfCombineDirectional(highp sampler2DArray maps, vec2 uv, int firstMap,
                            vec4 weights[SRBF_K], vec4 scale[SRBF_K], vec4 bias[SRBF_K]) {
    vec3 sum = vec3(0.0);
    for (int i = 0; i < SRBF_K; ++i) {
        vec3 stored = textureLod(maps, vec3(uv, float(firstMap + i)), 0.0).rgb;
        sum += weights[i].rgb * srbfDecode(stored, scale[i].rgb, bias[i].rgb);
    }
    return sum;
}
