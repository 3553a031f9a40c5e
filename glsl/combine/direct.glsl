// SPDX-License-Identifier: MIT
/* srbfDirect: the direct diffuse light of a directional light of unit irradiance, as irradiance.
   use:    vec3 srbfDirect(vec3 normal, vec3 toLight, vec3 visibility)
   domain: unit vectors; visibility: 0 or more, after shadows and transmittance
   twin:   srbf.visibility.shadow.direct
   cite:   Lambert1760 */
vec3 srbfDirect(vec3 normal, vec3 toLight, vec3 visibility) {
    return max(dot(normal, toLight), 0.0) * visibility;
}
