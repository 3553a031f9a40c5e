// SPDX-License-Identifier: MIT
/* srbfSpotCone: smoothstep in the cosine, from 0 at a spot's outer half-angle to 1 at its inner one.
   use:    float srbfSpotCone(float versine, float versineInner, float versineOuter)
   domain: all three 1 - cos of an angle off the spot's axis, so that narrow cones keep their digits; versineInner <= versineOuter;
           result in [0, 1]; versineInner 3 and versineOuter 4 are no cone: 1 everywhere
   twin:   srbf.light_geometry.spot_cone
   cite:   GLSL 3.30 specification, section 8.3, smoothstep */
float srbfSpotCone(float versine, float versineInner, float versineOuter) {
    // 1e-6 as in the twin: inner = outer stays a step without dividing by zero.
    float t = clamp((versineOuter - versine) / max(versineOuter - versineInner, 1e-6), 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}
