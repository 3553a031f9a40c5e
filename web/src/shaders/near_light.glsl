// SPDX-License-Identifier: MIT
// Light from bright surfels, as much as receivers see of the cells that these are in, added to `former`: the arithmetic of srbf/visibility/near_sources.py.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "surfels/near_light.glsl"

uniform sampler2D places;   // less the middle of all cells, meters
uniform sampler2D normals;
uniform sampler2D seen;     // how much of each cell, `rows` texels below each other
uniform sampler2D sources;  // rows: place and area, normal and slot of the cell, radiosity, of one surfel a column
uniform sampler2D former;
uniform int count;          // of columns
uniform int rows;           // texels of receivers

out vec4 irradiance;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec3 place = texelFetch(places, at, 0).xyz;
    vec3 light = srbfNearLight(sources, count, seen, rows, at, place, texelFetch(normals, at, 0).xyz);
    irradiance = vec4(texelFetch(former, at, 0).rgb + light, 1.0);
}
