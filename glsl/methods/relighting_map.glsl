// SPDX-License-Identifier: MIT
/* srbfRelightDirectional, srbfRelightPoint: a receiver's response to the lights, from relighting maps; add the results of all
   lights, then call srbfFinish once.
   use:    vec3 srbfRelightDirectional(sampler2DArray maps, vec2 uv, int firstMap,
                                       vec4 weights[SRBF_K], vec4 scale[SRBF_K], vec4 bias[SRBF_K])
           vec3 srbfRelightPoint(sampler2DArray maps, vec2 uv, int firstMap, sampler2D rTable,
                                 vec4 centers[SRBF_K], vec4 scale[SRBF_K], vec4 bias[SRBF_K], vec3 receiver, SrbfPointLight pointLight)
   domain: firstMap 0 where one pass combines all maps; receiver the world position of this texel, meters, and the light in the
           asset's frame; weights summed on the host over all directional and environment lights
   twin:   srbf.methods.linear_response
   cite:   Wong2005, "Directional-Source Shader", "Point-Source Shader" */
#include "combine/directional.glsl"
#include "combine/finish.glsl"
#include "combine/point.glsl"
#include "lights/point_light_strength.glsl"
#include "lights/light_direction.glsl"
#include "lights/light_vector.glsl"

vec3 srbfRelightDirectional(highp sampler2DArray maps, vec2 uv, int firstMap,
                            vec4 weights[SRBF_K], vec4 scale[SRBF_K], vec4 bias[SRBF_K]) {
    return srbfCombineDirectional(maps, uv, firstMap, weights, scale, bias);
}

vec3 srbfRelightPoint(highp sampler2DArray maps, vec2 uv, int firstMap, highp sampler2D rTable,
                      vec4 centers[SRBF_K], vec4 scale[SRBF_K], vec4 bias[SRBF_K], vec3 receiver, SrbfPointLight pointLight) {
    vec3 lightVector = srbfLightVector(pointLight.position, pointLight.positionLow, receiver);
    float strength = srbfPointLightStrength(pointLight, lightVector);
    if (strength == 0.0) {
        return vec3(0.0);  // outside a spot's cone
    }
    vec3 lightDirection = srbfLightDirection(lightVector);
    return pointLight.color * strength * srbfCombinePoint(maps, uv, firstMap, rTable, lightDirection, centers, scale, bias);
}
