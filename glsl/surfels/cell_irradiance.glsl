// SPDX-License-Identifier: MIT
/* srbfCellIrradiance: mean irradiance of a white light on a cell of a surface, nothing between: at its middle far away, else at 4 x 4 points
   of a square.
   use:    float srbfCellIrradiance(vec4 cell, vec3 normal, SrbfPointLight pointLight, float lambertian)
   domain: cell: place, m, less the same origin as the light's, and area, square meters; unit normal; the rest as srbfPartIrradiance
   twin:   srbf.visibility.received.ReceivedLight.irradiance
   cite:   - */
#include "lights/light_vector.glsl"
#include "surfels/part_irradiance.glsl"
#include "surfels/tangents.glsl"

float srbfCellIrradiance(vec4 cell, vec3 normal, SrbfPointLight pointLight, float lambertian) {
    const float NEAR_SIDES = 8.0;  // sides of a cell, closer than which it is measured by PARTS x PARTS points;
    const float NEAR_CONE = 64.0;  // of a spot of a half-angle below 120 degrees, whose cone may end in it
    const int PARTS = 4;
    vec3 lightVector = srbfLightVector(pointLight.position, pointLight.positionLow, cell.xyz);
    float sides = pointLight.versineOuter < 1.5 ? NEAR_CONE : NEAR_SIDES;
    if (dot(lightVector, lightVector) >= sides * sides * cell.w) {
        return srbfPartIrradiance(lightVector, normal, pointLight, lambertian, cell.w);
    }
    vec3 tangent;
    vec3 bitangent;
    srbfTangents(normal, tangent, bitangent);
    float total = 0.0;
    for (int part = 0; part < PARTS * PARTS; ++part) {
        vec2 at = sqrt(cell.w) * ((vec2(float(part / PARTS), float(part % PARTS)) + 0.5) / float(PARTS) - 0.5);
        vec3 there = lightVector - at.x * tangent - at.y * bitangent;
        total += srbfPartIrradiance(there, normal, pointLight, lambertian, cell.w / float(PARTS * PARTS));
    }
    return total / float(PARTS * PARTS);
}
