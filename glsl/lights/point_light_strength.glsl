// SPDX-License-Identifier: MIT
/* srbfPointLightStrength: the attenuation of a point light, times the cone of a spot, without the color.
   use:    float srbfPointLightStrength(SrbfPointLight pointLight, vec3 lightVector)
   domain: lightVector = S - P in meters, from srbfLightVector; a point light without a cone has versineInner 3, versineOuter 4
   twin:   srbf.methods.relighting_map.receiver_weights
   cite:   Wong2005, "Attenuation" */
#include "lights/attenuation.glsl"
#include "lights/light_direction.glsl"
#include "lights/spot_cone.glsl"
#include "lights/versine.glsl"

struct SrbfPointLight {
    vec3 position;       // S, meters, in the asset's frame
    vec3 positionLow;    // what single precision dropped of S, or zero
    vec3 color;          // irradiance at the distance a0, scene-linear
    vec3 axis;           // where a spot shines, unit; any unit vector for a point light
    float a0;            // meters
    float radius;        // meters, above 0
    float versineInner;  // 1 - cos of a spot's inner half-angle; 3 for a point light
    float versineOuter;  // 1 - cos of a spot's outer half-angle; 4 for a point light
    int falloff;         // SRBF_FALLOFF_LINEAR or SRBF_FALLOFF_INVERSE_SQUARE
};

float srbfPointLightStrength(SrbfPointLight pointLight, vec3 lightVector) {
    float versine = srbfVersine(-srbfLightDirection(lightVector), pointLight.axis);
    float cone = srbfSpotCone(versine, pointLight.versineInner, pointLight.versineOuter);
    return cone * srbfAttenuation(length(lightVector), pointLight.a0, pointLight.radius, pointLight.falloff);
}
