// SPDX-License-Identifier: MIT
/* srbfNeuralMapDistant, srbfNeuralMapPoints: response per texel to lights at infinity, or to point and spot lights, from its code; add the
   results of all passes, then call srbfFinish once.
   use:    vec3 srbfNeuralMapDistant(vec4 units[SRBF_UNIT_VECTORS], vec4 network[SRBF_NETWORK],
                                     vec4 distant[2 * SRBF_DISTANT], int distantCount)
           vec3 srbfNeuralMapPoints(vec4 units[SRBF_UNIT_VECTORS], vec4 network[SRBF_NETWORK],
                                    vec3 receiver, vec4 pointLights[4 * SRBF_POINT_LIGHTS], int pointLightCount)
   domain: units from srbfNeuralCodes, network as there; distant in twos, a unit direction toward the light and its color, the first
           distantCount in use: directional lights, and the nodes that an environment shines from; receiver the world position of this
           texel, meters, and the lights in the asset's frame; pointLights in fours as srbfUnpackPointLight takes them
   twin:   srbf.methods.linear_response
   cite:   Dulecha2020 */
#include "combine/finish.glsl"
#include "combine/neural_codes.glsl"
#include "combine/neural_toward.glsl"
#ifdef SRBF_POINT_LIGHTS
#include "lights/point_lights_at.glsl"
#endif

#ifdef SRBF_DISTANT
vec3 srbfNeuralMapDistant(vec4 units[SRBF_UNIT_VECTORS], vec4 network[SRBF_NETWORK], vec4 distant[2 * SRBF_DISTANT], int distantCount) {
    vec3 sum = vec3(0.0);
    for (int l = 0; l < distantCount; ++l) {
        sum += distant[2 * l + 1].rgb * srbfNeuralToward(units, distant[2 * l].xyz, network);
    }
    return sum;
}
#endif

#ifdef SRBF_POINT_LIGHTS
vec3 srbfNeuralMapPoints(vec4 units[SRBF_UNIT_VECTORS], vec4 network[SRBF_NETWORK], vec3 receiver,
                         vec4 pointLights[4 * SRBF_POINT_LIGHTS], int pointLightCount) {
    vec4 directions[SRBF_POINT_LIGHTS];
    vec4 colors[SRBF_POINT_LIGHTS];
    int shining = srbfPointLightsAt(pointLights, pointLightCount, receiver, directions, colors);
    vec3 sum = vec3(0.0);
    for (int l = 0; l < shining; ++l) {
        sum += colors[l].rgb * srbfNeuralToward(units, directions[l].xyz, network);
    }
    return sum;
}
#endif
