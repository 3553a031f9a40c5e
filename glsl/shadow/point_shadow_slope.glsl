// SPDX-License-Identifier: MIT
/* srbfPointShadowSlope: rise of one over the depth of a receiver's plane across a perspective shadow map, per unit of the tangent.
   use:    vec2 srbfPointShadowSlope(vec3 fromLight, vec3 normal, vec3 across, vec3 up, float steepest)
   domain: fromLight = P - S, meters; normal: of the plane, unit; result in 1/m, in x and in y, within +-steepest, as of a plane that the
           light grazes
   twin:   srbf.visibility.point_shadow.slope
   cite:   Reeves1987 */
vec2 srbfPointShadowSlope(vec3 fromLight, vec3 normal, vec3 across, vec3 up, float steepest) {
    float offset = dot(normal, fromLight);
    offset = abs(offset) < 1e-9 ? (offset < 0.0 ? -1e-9 : 1e-9) : offset;
    return clamp(vec2(dot(normal, across), dot(normal, up)) / offset, vec2(-steepest), vec2(steepest));
}
