// SPDX-License-Identifier: MIT
/* srbfCombinePoint: sum over SRBF_K maps of R_i(L) times coefficient, L being this receiver's own light direction.
   use:    vec3 srbfCombinePoint(sampler2DArray maps, vec2 uv, int firstMap, sampler2D rTable, vec3 lightDirection,
                                 vec4 centers[SRBF_K], vec4 scale[SRBF_K], vec4 bias[SRBF_K])
   domain: layers firstMap ... firstMap + SRBF_K - 1 of maps; lightDirection of length 1, or 0 where the receiver coincides with the point
           light; centers as srbfCenterWeight takes them, of the same maps; result signed, for unit irradiance
   twin:   srbf.methods.relighting_map.receiver_weights
   cite:   Wong2005, fig. 8 and "Point-Source Shader" */
#include "combine/center_weight.glsl"
#include "combine/decode.glsl"

#ifndef SRBF_K
#error define SRBF_K: how many maps this pass combines
#endif

vec3 srbfCombinePoint(highp sampler2DArray maps, vec2 uv, int firstMap, highp sampler2D rTable, vec3 lightDirection,
                      vec4 centers[SRBF_K], vec4 scale[SRBF_K], vec4 bias[SRBF_K]) {
    vec3 sum = vec3(0.0);
    for (int i = 0; i < SRBF_K; ++i) {
        float weight = srbfCenterWeight(rTable, lightDirection, centers[i]);
        vec3 stored = textureLod(maps, vec3(uv, float(firstMap + i)), 0.0).rgb;
        sum += weight * srbfDecode(stored, scale[i].rgb, bias[i].rgb);
    }
    return sum;
}
