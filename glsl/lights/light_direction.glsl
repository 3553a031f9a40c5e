// SPDX-License-Identifier: MIT
/* srbfLightDirection: the unit vector along L; the zero vector, where a receiver coincides with the point light, stays zero.
   use:    vec3 srbfLightDirection(vec3 lightVector)
   domain: |lightVector| of 0 or within [1e-18, 1e18]; result of length 1 or 0
   twin:   srbf.sphere.normalize
   cite:   Wong2005, "Evaluating the Basis Functions" */
vec3 srbfLightDirection(vec3 lightVector) {
    float dist = length(lightVector);
    return dist > 0.0 ? lightVector / dist : vec3(0.0);
}
