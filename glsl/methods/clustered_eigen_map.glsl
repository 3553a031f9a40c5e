// SPDX-License-Identifier: MIT
/* srbfClusteredDirectional, srbfClusteredDirectionalFiltered, srbfClusteredPoint, srbfClusteredPointFiltered: a receiver's response to the
   lights, from coefficient maps whose light functions depend on its cluster; add the results of all lights, then call srbfFinish once.
   use:    vec3 srbfClusteredDirectional(sampler2DArray planes, sampler2D clusters, ivec2 texel, int firstLayer, sampler2D weights,
                                         vec4 scale[SRBF_LAYERS], vec4 bias[SRBF_LAYERS])
           vec3 srbfClusteredPoint(sampler2DArray planes, sampler2D clusters, ivec2 texel, int firstLayer, sampler2D wTable,
                                   int tableSize, vec4 scale[SRBF_LAYERS], vec4 bias[SRBF_LAYERS], vec3 receiver, SrbfPointLight pointLight)
           vec3 srbfClusteredDirectionalFiltered(..., vec2 uv, ...) and vec3 srbfClusteredPointFiltered(..., vec2 uv, ...): the same with a
           place instead of a texel
   domain: planes sampled nearest, never filtered: a component has another meaning in another cluster; the filtered functions rebuild the
           four texels about uv and mix the results bilinearly; weights (SRBF_COMPONENTS + 1) texels wide, one row per cluster; firstLayer
           0 where one pass combines all layers; receiver and light as in the eigen map
   twin:   srbf.methods.linear_response
   cite:   Sloan2003; Kristensen2005 */
#include "combine/cluster_index.glsl"
#include "combine/finish.glsl"
#include "combine/components_directional.glsl"
#include "combine/components_point.glsl"
#include "lights/point_light_strength.glsl"
#include "lights/light_direction.glsl"
#include "lights/light_vector.glsl"

vec3 srbfClusteredDirectional(highp sampler2DArray planes, highp sampler2D clusters, ivec2 texel, int firstLayer, highp sampler2D weights,
                              vec4 scale[SRBF_LAYERS], vec4 bias[SRBF_LAYERS]) {
    vec2 center = (vec2(texel) + 0.5) / vec2(textureSize(planes, 0).xy);
    return srbfCombineComponentsDirectional(planes, center, firstLayer, weights, srbfClusterIndex(clusters, texel), scale, bias);
}

vec3 srbfClusteredDirectionalFiltered(highp sampler2DArray planes, highp sampler2D clusters, vec2 uv, int firstLayer,
                                      highp sampler2D weights, vec4 scale[SRBF_LAYERS], vec4 bias[SRBF_LAYERS]) {
    ivec2 size = textureSize(planes, 0).xy;
    vec2 place = uv * vec2(size) - 0.5;
    vec2 base = floor(place);
    vec2 part = place - base;
    vec3 sum = vec3(0.0);
    for (int i = 0; i < 4; ++i) {
        ivec2 corner = ivec2(i % 2, i / 2);
        ivec2 texel = clamp(ivec2(base) + corner, ivec2(0), size - 1);
        vec2 share = mix(1.0 - part, part, vec2(corner));
        sum += share.x * share.y * srbfClusteredDirectional(planes, clusters, texel, firstLayer, weights, scale, bias);
    }
    return sum;
}

vec3 srbfClusteredPoint(highp sampler2DArray planes, highp sampler2D clusters, ivec2 texel, int firstLayer, highp sampler2D wTable,
                        int tableSize, vec4 scale[SRBF_LAYERS], vec4 bias[SRBF_LAYERS], vec3 receiver, SrbfPointLight pointLight) {
    vec3 lightVector = srbfLightVector(pointLight.position, pointLight.positionLow, receiver);
    float strength = srbfPointLightStrength(pointLight, lightVector);
    if (strength == 0.0) {
        return vec3(0.0);  // outside a spot's cone
    }
    vec2 center = (vec2(texel) + 0.5) / vec2(textureSize(planes, 0).xy);
    int cluster = srbfClusterIndex(clusters, texel);
    vec3 lightDirection = srbfLightDirection(lightVector);
    return pointLight.color * strength
         * srbfCombineComponentsPoint(planes, center, firstLayer, wTable, tableSize, cluster, lightDirection, scale, bias);
}

vec3 srbfClusteredPointFiltered(highp sampler2DArray planes, highp sampler2D clusters, vec2 uv, int firstLayer, highp sampler2D wTable,
                                int tableSize, vec4 scale[SRBF_LAYERS], vec4 bias[SRBF_LAYERS], vec3 receiver, SrbfPointLight pointLight) {
    ivec2 size = textureSize(planes, 0).xy;
    vec2 place = uv * vec2(size) - 0.5;
    vec2 base = floor(place);
    vec2 part = place - base;
    vec3 sum = vec3(0.0);
    for (int i = 0; i < 4; ++i) {
        ivec2 corner = ivec2(i % 2, i / 2);
        ivec2 texel = clamp(ivec2(base) + corner, ivec2(0), size - 1);
        vec2 share = mix(1.0 - part, part, vec2(corner));
        sum += share.x * share.y
             * srbfClusteredPoint(planes, clusters, texel, firstLayer, wTable, tableSize, scale, bias, receiver, pointLight);
    }
    return sum;
}
