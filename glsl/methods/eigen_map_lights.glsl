// SPDX-License-Identifier: MIT
/* srbfEigenMapLights: a receiver's response to all lights at once, from scalar coefficient maps: directional, environments, points and
   spots.
   use:    vec3 srbfEigenMapLights(sampler2DArray planes, vec2 uv, float level, int firstLayer, sampler2D weights, sampler2D wTable,
                                   int tableSize, vec4 scale[SRBF_LAYERS], vec4 bias[SRBF_LAYERS], vec3 receiver,
                                   vec4 pointLights[4 * SRBF_POINT_LIGHTS], int pointLightCount)
   domain: weights (SRBF_COMPONENTS + 1) x 1 texels, summed on the host over all directional and environment lights, or 0; pointLights in
           fours as srbfUnpackPointLight takes them, the first pointLightCount in use (0 is allowed); receiver the world position of this
           place, meters, one frame with the lights; firstLayer 0 where one pass combines all layers; level: mip level, 0 without mip
           maps. Call srbfFinish once, after all passes
   twin:   srbf.methods.linear_response
   cite:   Wong2005, "Directional-Source Shader", "Point-Source Shader"; the coefficient maps are ours */
#include "combine/finish.glsl"
#include "combine/components_point_lights.glsl"
#include "lights/point_lights_at.glsl"

vec3 srbfEigenMapLights(highp sampler2DArray planes, vec2 uv, float level, int firstLayer, highp sampler2D weights,
                        highp sampler2D wTable, int tableSize, vec4 scale[SRBF_LAYERS], vec4 bias[SRBF_LAYERS], vec3 receiver,
                        vec4 pointLights[4 * SRBF_POINT_LIGHTS], int pointLightCount) {
    vec4 directions[SRBF_POINT_LIGHTS];
    vec4 colors[SRBF_POINT_LIGHTS];
    int shining = srbfPointLightsAt(pointLights, pointLightCount, receiver, directions, colors);
    return srbfCombineComponentsPointLights(planes, uv, level, firstLayer, weights, 0, wTable, tableSize, scale, bias, directions, colors, shining);
}
