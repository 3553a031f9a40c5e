// SPDX-License-Identifier: MIT
/* srbfCombinePointLights: sum over SRBF_K maps of coefficient times the weight of all lights together, each texel fetched once.
   use:    vec3 srbfCombinePointLights(sampler2DArray maps, vec2 uv, float level, int firstMap, vec4 weights[SRBF_K], sampler2D rTable,
                                 vec4 centers[SRBF_K], vec4 scale[SRBF_K], vec4 bias[SRBF_K],
                                 vec4 directions[SRBF_POINT_LIGHTS], vec4 colors[SRBF_POINT_LIGHTS], int shining)
   domain: weights, scale, bias as in srbfCombineDirectional, weights 0 where no directional or environment light shines; level: of mip
           maps, 0 without; centers as srbfCenterWeight takes them; directions, colors, shining from srbfPointLightsAt, all of them with
           SRBF_UNROLLED; result signed
   twin:   srbf.methods.linear_response
   cite:   Wong2005, fig. 6 and 8 */
#include "combine/center_weight.glsl"
#include "combine/decode.glsl"

#ifndef SRBF_K
#error define SRBF_K: how many maps this pass combines
#endif
#ifndef SRBF_POINT_LIGHTS
#error define SRBF_POINT_LIGHTS: how many point lights a pass takes at most
#endif

vec3 srbfCombinePointLights(highp sampler2DArray maps, vec2 uv, float level, int firstMap, vec4 weights[SRBF_K], highp sampler2D rTable,
                      vec4 centers[SRBF_K], vec4 scale[SRBF_K], vec4 bias[SRBF_K],
                      vec4 directions[SRBF_POINT_LIGHTS], vec4 colors[SRBF_POINT_LIGHTS], int shining) {
    vec3 sum = vec3(0.0);
#ifdef SRBF_UNROLLED
    const int most = SRBF_POINT_LIGHTS;
#else
    int most = shining;
#endif
    for (int i = 0; i < SRBF_K; ++i) {
        vec3 weight = weights[i].rgb;
        for (int j = 0; j < most; ++j) {
            weight += colors[j].rgb * srbfCenterWeight(rTable, directions[j].xyz, centers[i]);
        }
        vec3 stored = textureLod(maps, vec3(uv, float(firstMap + i)), level).rgb;
        sum += weight * srbfDecode(stored, scale[i].rgb, bias[i].rgb);
    }
    return sum;
}
