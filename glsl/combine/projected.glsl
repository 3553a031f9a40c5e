// SPDX-License-Identifier: MIT
/* srbfCombineProjected: sum over SRBF_K maps of weight times what is stored, decoding folded into the weights: the least that far lights cost.
   use:    vec3 srbfCombineProjected(sampler2DArray maps, vec2 uv, float level, int firstMap, vec4 weights[SRBF_K], vec3 offset)
   domain: weights: those of srbfCombineDirectional times each map's scale; offset: the sum over maps of weight times bias, with one pass
           alone; level: of mip maps, 0 without; result signed, before the clamp
   twin:   srbf.methods.linear_response
   cite:   Wong2005, fig. 6 */
#ifndef SRBF_K
#error define SRBF_K: how many maps this pass combines
#endif

vec3 srbfCombineProjected(highp sampler2DArray maps, vec2 uv, float level, int firstMap, vec4 weights[SRBF_K], vec3 offset) {
    vec3 sum = offset;
    for (int i = 0; i < SRBF_K; ++i) {
        sum += weights[i].rgb * textureLod(maps, vec3(uv, float(firstMap + i)), level).rgb;
    }
    return sum;
}
