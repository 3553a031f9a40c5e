// SPDX-License-Identifier: MIT
/* srbfPointShadowPlace: where a place falls on a perspective shadow map (xy, 0 to 1), and one over its depth (z, 1/m): larger is nearer.
   use:    vec3 srbfPointShadowPlace(vec3 fromLight, vec3 across, vec3 up, vec3 ahead, float reach)
   domain: fromLight = P - S, meters, in front of the light: dot(fromLight, ahead) > 0; across, up, ahead orthonormal; reach: tangent of the
           map's half-angle. One over the depth of a plane is linear on the map, so srbfShadowFraction takes it as a height
   twin:   srbf.visibility.point_shadow.place
   cite:   Williams1978 */
vec3 srbfPointShadowPlace(vec3 fromLight, vec3 across, vec3 up, vec3 ahead, float reach) {
    float nearness = 1.0 / dot(fromLight, ahead);
    vec2 tangents = vec2(dot(fromLight, across), dot(fromLight, up)) * nearness;
    return vec3(tangents / (2.0 * reach) + 0.5, nearness);
}
