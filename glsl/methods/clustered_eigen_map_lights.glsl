// SPDX-License-Identifier: MIT
/* srbfClusteredLights, srbfClusteredLightsFiltered: a receiver's response to all lights at once, from coefficient maps whose light
   functions depend on its cluster: directional, environments, points and spots.
   use:    vec3 srbfClusteredLights(sampler2DArray planes, sampler2D clusters, ivec2 texel, int firstLayer, sampler2D weights,
                                    sampler2D wTable, int tableSize, vec4 scale[SRBF_LAYERS], vec4 bias[SRBF_LAYERS], vec3 receiver,
                                    vec4 pointLights[4 * SRBF_POINT_LIGHTS], int pointLightCount)
           vec3 srbfClusteredLightsFiltered(..., vec2 uv, ...): the same with a place instead of a texel
   domain: planes and clusters as in srbfClusteredDirectional, never filtered; the filtered function rebuilds the four texels about uv and
           mixes the results bilinearly; weights (SRBF_COMPONENTS + 1) texels wide, one row per cluster, or 0; pointLights in fours as
           srbfUnpackPointLight takes them, the first pointLightCount in use (0 is allowed); receiver the world position of this place,
           meters, one frame with the lights. Call srbfFinish once, after all passes
   twin:   srbf.methods.linear_response
   cite:   Sloan2003; Kristensen2005 */
#include "combine/cluster_index.glsl"
#include "combine/finish.glsl"
#include "combine/components_point_lights.glsl"
#include "lights/point_lights_at.glsl"

vec3 srbfClusteredLights(highp sampler2DArray planes, highp sampler2D clusters, ivec2 texel, int firstLayer, highp sampler2D weights,
                         highp sampler2D wTable, int tableSize, vec4 scale[SRBF_LAYERS], vec4 bias[SRBF_LAYERS], vec3 receiver,
                         vec4 pointLights[4 * SRBF_POINT_LIGHTS], int pointLightCount) {
    vec4 directions[SRBF_POINT_LIGHTS];
    vec4 colors[SRBF_POINT_LIGHTS];
    int shining = srbfPointLightsAt(pointLights, pointLightCount, receiver, directions, colors);
    vec2 center = (vec2(texel) + 0.5) / vec2(textureSize(planes, 0).xy);
    int cluster = srbfClusterIndex(clusters, texel);
    return srbfCombineComponentsPointLights(planes, center, 0.0, firstLayer, weights, cluster, wTable, tableSize, scale, bias,
                                  directions, colors, shining);
}

vec3 srbfClusteredLightsFiltered(highp sampler2DArray planes, highp sampler2D clusters, vec2 uv, int firstLayer, highp sampler2D weights,
                                 highp sampler2D wTable, int tableSize, vec4 scale[SRBF_LAYERS], vec4 bias[SRBF_LAYERS], vec3 receiver,
                                 vec4 pointLights[4 * SRBF_POINT_LIGHTS], int pointLightCount) {
    vec4 directions[SRBF_POINT_LIGHTS];
    vec4 colors[SRBF_POINT_LIGHTS];
    int shining = srbfPointLightsAt(pointLights, pointLightCount, receiver, directions, colors);
    ivec2 size = textureSize(planes, 0).xy;
    vec2 place = uv * vec2(size) - 0.5;
    vec2 base = floor(place);
    vec2 part = place - base;
    vec3 sum = vec3(0.0);
    for (int i = 0; i < 4; ++i) {
        ivec2 corner = ivec2(i % 2, i / 2);
        ivec2 texel = clamp(ivec2(base) + corner, ivec2(0), size - 1);
        vec2 share = mix(1.0 - part, part, vec2(corner));
        vec2 center = (vec2(texel) + 0.5) / vec2(size);
        sum += share.x * share.y
             * srbfCombineComponentsPointLights(planes, center, 0.0, firstLayer, weights, srbfClusterIndex(clusters, texel), wTable, tableSize,
                                      scale, bias, directions, colors, shining);
    }
    return sum;
}
