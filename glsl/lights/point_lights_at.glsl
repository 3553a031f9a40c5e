// SPDX-License-Identifier: MIT
/* srbfPointLightsAt: which of many point lights shine on a receiver, from where and how brightly.
   use:    int srbfPointLightsAt(vec4 pointLights[4 * SRBF_POINT_LIGHTS], int pointLightCount, vec3 receiver,
                           out vec4 directions[SRBF_POINT_LIGHTS], out vec4 colors[SRBF_POINT_LIGHTS])
   domain: pointLights in fours as srbfUnpackPointLight takes them, the first pointLightCount of them in use; receiver in their frame,
           meters; result: how many shine there. So many entries hold, in .xyz, the unit direction (0 where the receiver coincides with
           the point light) and color times strength; the rest are 0. Lights whose cone misses the receiver are left out. With
           SRBF_UNROLLED each light keeps its place, so that GPUs hold all in registers, and the result is SRBF_POINT_LIGHTS
   twin:   srbf.light_geometry.light_vectors
   cite:   Wong2005, fig. 8 to 10 */
#include "lights/point_light_strength.glsl"
#include "lights/light_direction.glsl"
#include "lights/light_vector.glsl"
#include "lights/unpack_point_light.glsl"

#ifndef SRBF_POINT_LIGHTS
#error define SRBF_POINT_LIGHTS: how many pointLights a pass takes at most
#endif

int srbfPointLightsAt(vec4 pointLights[4 * SRBF_POINT_LIGHTS], int pointLightCount, vec3 receiver,
                out vec4 directions[SRBF_POINT_LIGHTS], out vec4 colors[SRBF_POINT_LIGHTS]) {
    for (int j = 0; j < SRBF_POINT_LIGHTS; ++j) {
        directions[j] = vec4(0.0);
        colors[j] = vec4(0.0);
    }
#ifdef SRBF_UNROLLED
    const int most = SRBF_POINT_LIGHTS;
#else
    int most = min(pointLightCount, SRBF_POINT_LIGHTS);
#endif
    int shining = 0;
    for (int j = 0; j < most; ++j) {
        SrbfPointLight pointLight = srbfUnpackPointLight(pointLights[4 * j], pointLights[4 * j + 1], pointLights[4 * j + 2], pointLights[4 * j + 3]);
        vec3 lightVector = srbfLightVector(pointLight.position, pointLight.positionLow, receiver);
        float strength = srbfPointLightStrength(pointLight, lightVector);
#ifdef SRBF_UNROLLED
        directions[j] = vec4(srbfLightDirection(lightVector), 0.0);
        colors[j] = j < pointLightCount ? vec4(pointLight.color * strength, 0.0) : vec4(0.0);
        shining = most;
#else
        if (strength > 0.0) {
            directions[shining] = vec4(srbfLightDirection(lightVector), 0.0);
            colors[shining] = vec4(pointLight.color * strength, 0.0);
            ++shining;
        }
#endif
    }
    return shining;
}
