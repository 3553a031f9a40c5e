// SPDX-License-Identifier: MIT
/* srbfCombineProjected: sum over SRBF_K maps of projected weight times stored value; the weights include the decoding.
   use:    vec3 srbfCombineProjected(sampler2DArray maps, vec2 uv, float level, int firstMap, vec4 weights[SRBF_K], vec3 offset)
   domain: weights: those of srbfCombineDirectional times each map's scale; offset: the sum over maps of weight times bias, with one pass
           alone; level: mip level, 0 without mip maps; result signed, before the clamp
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
