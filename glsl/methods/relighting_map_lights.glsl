// SPDX-License-Identifier: MIT
/* srbfRelightLights: a receiver's response to all lights at once, from relighting maps: directional, environments, points and spots.
   use:    vec3 srbfRelightLights(sampler2DArray maps, vec2 uv, float level, int firstMap, vec4 weights[SRBF_K], sampler2D rTable,
                                  vec4 centers[SRBF_K], vec4 scale[SRBF_K], vec4 bias[SRBF_K], vec3 receiver,
                                  vec4 pointLights[4 * SRBF_POINT_LIGHTS], int pointLightCount)
   domain: weights summed on the host over all directional and environment lights, or 0; pointLights in fours as srbfUnpackPointLight
           takes them, the first pointLightCount in use (0 is allowed); receiver the world position of this place, meters, one frame with
           the lights; firstMap 0 where one pass combines all maps; level: mip level, 0 without mip maps. Call srbfFinish once, after all
           passes
   twin:   srbf.methods.linear_response
   cite:   Wong2005, "Directional-Source Shader", "Point-Source Shader" */
#include "combine/finish.glsl"
#include "combine/point_lights.glsl"
#include "lights/point_lights_at.glsl"

vec3 srbfRelightLights(highp sampler2DArray maps, vec2 uv, float level, int firstMap, vec4 weights[SRBF_K], highp sampler2D rTable,
                       vec4 centers[SRBF_K], vec4 scale[SRBF_K], vec4 bias[SRBF_K], vec3 receiver,
                       vec4 pointLights[4 * SRBF_POINT_LIGHTS], int pointLightCount) {
    vec4 directions[SRBF_POINT_LIGHTS];
    vec4 colors[SRBF_POINT_LIGHTS];
    int shining = srbfPointLightsAt(pointLights, pointLightCount, receiver, directions, colors);
    return srbfCombinePointLights(maps, uv, level, firstMap, weights, rTable, centers, scale, bias, directions, colors, shining);
}
