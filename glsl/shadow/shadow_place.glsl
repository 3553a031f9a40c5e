// SPDX-License-Identifier: MIT
/* srbfShadowPlace: where a point falls on a sun's shadow map (xy, 0 to 1), and its height towards the light (z, meters).
   use:    vec3 srbfShadowPlace(vec3 point, vec3 across, vec3 up, vec3 toLight, vec2 low, float extent)
   domain: across, up, toLight orthonormal, one frame with the point; low, extent: corner and side of the square that the map covers, meters
   twin:   srbf.visibility.shadow.place
   cite:   Williams1978 */
vec3 srbfShadowPlace(vec3 point, vec3 across, vec3 up, vec3 toLight, vec2 low, float extent) {
    return vec3((vec2(dot(point, across), dot(point, up)) - low) / extent, dot(point, toLight));
}
