// SPDX-License-Identifier: MIT
/* srbfEigenMapDirectional, srbfEigenMapPoint: a receiver's response to the lights, from scalar coefficient maps; add the results of all
   lights, then call srbfFinish once.
   use:    vec3 srbfEigenMapDirectional(sampler2DArray planes, vec2 uv, int firstLayer, sampler2D weights,
                                        vec4 scale[SRBF_LAYERS], vec4 bias[SRBF_LAYERS])
           vec3 srbfEigenMapPoint(sampler2DArray planes, vec2 uv, int firstLayer, sampler2D wTable, int tableSize,
                                  vec4 scale[SRBF_LAYERS], vec4 bias[SRBF_LAYERS], vec3 receiver, SrbfPointLight pointLight)
   domain: firstLayer 0 where one pass combines all layers; planes may be filtered linearly; receiver the world position of this texel,
           meters, and the light in the asset's frame; weights summed on the host over all directional and environment lights,
           (SRBF_COMPONENTS + 1) x 1 texels
   twin:   srbf.methods.linear_response
   cite:   Wong2005, "Directional-Source Shader", "Point-Source Shader"; the coefficient maps are ours */
#include "combine/finish.glsl"
#include "combine/components_directional.glsl"
#include "combine/components_point.glsl"
#include "lights/point_light_strength.glsl"
#include "lights/light_direction.glsl"
#include "lights/light_vector.glsl"

vec3 srbfEigenMapDirectional(highp sampler2DArray planes, vec2 uv, int firstLayer, highp sampler2D weights,
                             vec4 scale[SRBF_LAYERS], vec4 bias[SRBF_LAYERS]) {
    return srbfCombineComponentsDirectional(planes, uv, firstLayer, weights, 0, scale, bias);
}

vec3 srbfEigenMapPoint(highp sampler2DArray planes, vec2 uv, int firstLayer, highp sampler2D wTable, int tableSize,
                       vec4 scale[SRBF_LAYERS], vec4 bias[SRBF_LAYERS], vec3 receiver, SrbfPointLight pointLight) {
    vec3 lightVector = srbfLightVector(pointLight.position, pointLight.positionLow, receiver);
    float strength = srbfPointLightStrength(pointLight, lightVector);
    if (strength == 0.0) {
        return vec3(0.0);  // outside a spot's cone
    }
    vec3 lightDirection = srbfLightDirection(lightVector);
    return pointLight.color * strength * srbfCombineComponentsPoint(planes, uv, firstLayer, wTable, tableSize, 0, lightDirection, scale, bias);
}
