// SPDX-License-Identifier: MIT
/* srbfCombineWeighted: srbfCombineDirectional with weights from a texture, such as environment_weights.frag leaves on the GPU.
   use:    vec3 srbfCombineWeighted(sampler2DArray maps, vec2 uv, float level, int firstMap, sampler2D weights,
                                    vec4 scale[SRBF_K], vec4 bias[SRBF_K])
   domain: weights RGBA32F, nearest, all maps' in one row; scale, bias of the maps of this pass; level: mip level, 0 without mip maps;
           result signed, before the clamp
   twin:   srbf.methods.linear_response
   cite:   Wong2005, fig. 6 */
#include "combine/decode.glsl"

#ifndef SRBF_K
#error define SRBF_K: how many maps this pass combines
#endif

vec3 srbfCombineWeighted(highp sampler2DArray maps, vec2 uv, float level, int firstMap, highp sampler2D weights,
                         vec4 scale[SRBF_K], vec4 bias[SRBF_K]) {
    vec3 sum = vec3(0.0);
    for (int i = 0; i < SRBF_K; ++i) {
        vec3 stored = textureLod(maps, vec3(uv, float(firstMap + i)), level).rgb;
        sum += texelFetch(weights, ivec2(firstMap + i, 0), 0).rgb * srbfDecode(stored, scale[i].rgb, bias[i].rgb);
    }
    return sum;
}
