// SPDX-License-Identifier: MIT
/* srbfUnpackPointLight: a point light from the four vec4 that an array holds for each.
   use:    SrbfPointLight srbfUnpackPointLight(vec4 a, vec4 b, vec4 c, vec4 d)
   domain: a: position, radius; b: positionLow, falloff 0 or 1; c: color as irradiance at 1 m, versineInner; d: axis, versineOuter.
           The light's a0 is 1: color times a0, or a0 squared, is the irradiance at 1 m
   twin:   srbf.gl.uniforms.packed_point_lights
   cite:   - */
#include "lights/point_light_strength.glsl"

SrbfPointLight srbfUnpackPointLight(vec4 a, vec4 b, vec4 c, vec4 d) {
    return SrbfPointLight(a.xyz, b.xyz, c.rgb, d.xyz, 1.0, a.w, c.w, d.w, int(b.w));
}
