// SPDX-License-Identifier: MIT
/* srbfPartIrradiance: irradiance of a white light at one point of a cell, nothing between.
   use:    float srbfPartIrradiance(vec3 lightVector, vec3 normal, SrbfPointLight pointLight, float lambertian, float area)
   domain: lightVector: from the point to the light, m; area (square meters) of what the point stands for, which takes at most half of a
           light: r^2 is at least area / 2 pi; lambertian: 1 for a light that shines by the cosine to its axis, as a part of an area light
           does, else 0
   twin:   srbf.visibility.received.ReceivedLight.irradiance
   cite:   - */
#include "lights/point_light_strength.glsl"

float srbfPartIrradiance(vec3 lightVector, vec3 normal, SrbfPointLight pointLight, float lambertian, float area) {
    float dist = length(lightVector);
    vec3 toLight = lightVector / max(dist, 1e-15);
    float cosine = dot(toLight, normal);
    if (cosine <= 0.0) {
        return 0.0;
    }
    float cone = srbfSpotCone(srbfVersine(-toLight, pointLight.axis), pointLight.versineInner, pointLight.versineOuter);
    float shining = mix(1.0, max(dot(-toLight, pointLight.axis), 0.0), lambertian);
    float radius = max(pointLight.radius, sqrt(area / 6.283185307179586));
    return cosine * cone * shining * srbfAttenuation(dist, pointLight.a0, radius, pointLight.falloff);
}
