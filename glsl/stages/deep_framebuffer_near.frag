// SPDX-License-Identifier: MIT
#version 330 core
// Light from bright surfels on receivers, as much as these see of the cells that the surfels are in: the arithmetic of
// srbf.visibility.near_sources. Blend ONE, ONE into a float target of one texel for each receiver.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "surfels/near_light.glsl"

uniform sampler2D receivers;  // place, meters
uniform sampler2D normals;
uniform sampler2D seen;       // how much of each cell, `rows` texels below each other
uniform sampler2D sources;    // rows: place and area, normal and slot of the cell, radiosity, of one surfel a column
uniform int count;            // of columns
uniform int rows;             // texels of receivers

layout(location = 0) out vec4 irradiance;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec3 place = texelFetch(receivers, at, 0).xyz;
    irradiance = vec4(srbfNearLight(sources, count, seen, rows, at, place, texelFetch(normals, at, 0).xyz), 1.0);
}
