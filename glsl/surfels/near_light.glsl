// SPDX-License-Identifier: MIT
/* srbfNearLight: irradiance of bright surfels on a receiver, as much as it sees of the cells that they are in.
   use:    vec3 srbfNearLight(highp sampler2D sources, int count, highp sampler2D seen, int rows, ivec2 at, vec3 place, vec3 normal)
   domain: sources: rows of place (m) and area, normal and slot of the cell, radiosity, a surfel in each of `count` columns; seen: how much
           of each cell receivers see, slots of `rows` texels below each other, at the receiver's texel `at`; place (m) and unit normal of it
   twin:   srbf.visibility.near_sources.NearReceivers.irradiance
   cite:   - */
#include "surfels/disc_factor.glsl"

vec3 srbfNearLight(highp sampler2D sources, int count, highp sampler2D seen, int rows, ivec2 at, vec3 place, vec3 normal) {
    vec3 total = vec3(0.0);
    for (int i = 0; i < count; ++i) {
        vec4 source = texelFetch(sources, ivec2(i, 0), 0);
        vec4 facing = texelFetch(sources, ivec2(i, 1), 0);
        float visible = texelFetch(seen, at + ivec2(0, rows * int(facing.w)), 0).r;
        if (visible > 0.0) {
            total += visible * srbfDiscFactor(source.xyz - place, normal, facing.xyz, source.w) * texelFetch(sources, ivec2(i, 2), 0).rgb;
        }
    }
    return total;
}
