// SPDX-License-Identifier: MIT
/* srbfProfiledIrradiance: srbfCellIrradiance of a light with a profile, by color.
   use:    vec3 srbfProfiledIrradiance(vec4 cell, vec3 normal, SrbfPointLight pointLight, sampler2D profile, vec3 across, vec3 up,
                                       float tangent)
   domain: cell: place, m, less the same origin as the light's, and area, square meters; unit normal; pointLight.axis is the profile's; the
           rest as srbfProfile
   twin:   srbf.visibility.received.ReceivedLight.irradiance
   cite:   - */
#include "lights/light_vector.glsl"
#include "lights/profile.glsl"
#include "surfels/part_irradiance.glsl"
#include "surfels/tangents.glsl"

vec3 srbfProfiledIrradiance(vec4 cell, vec3 normal, SrbfPointLight pointLight, highp sampler2D profile, vec3 across, vec3 up,
                            float tangent) {
    const float NEAR_SIDES = 8.0;  // as in srbfCellIrradiance,
    const float NEAR_CONE = 64.0;  // and this
    const int PARTS = 4;
    vec3 lightVector = srbfLightVector(pointLight.position, pointLight.positionLow, cell.xyz);
    float sides = pointLight.versineOuter < 1.5 ? NEAR_CONE : NEAR_SIDES;
    if (dot(lightVector, lightVector) >= sides * sides * cell.w) {
        return srbfProfile(profile, -lightVector, pointLight.axis, across, up, tangent)
             * srbfPartIrradiance(lightVector, normal, pointLight, 0.0, cell.w);
    }
    vec3 tangentVector;
    vec3 bitangent;
    srbfTangents(normal, tangentVector, bitangent);
    vec3 total = vec3(0.0);
    for (int part = 0; part < PARTS * PARTS; ++part) {
        vec2 at = sqrt(cell.w) * ((vec2(float(part / PARTS), float(part % PARTS)) + 0.5) / float(PARTS) - 0.5);
        vec3 there = lightVector - at.x * tangentVector - at.y * bitangent;
        total += srbfProfile(profile, -there, pointLight.axis, across, up, tangent)
               * srbfPartIrradiance(there, normal, pointLight, 0.0, cell.w / float(PARTS * PARTS));
    }
    return total / float(PARTS * PARTS);
}
