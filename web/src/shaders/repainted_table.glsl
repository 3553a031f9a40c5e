// SPDX-License-Identifier: MIT
// An asset's table for changed albedo, all bounces included; row i of the table is row i of the target.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "surfels/repainted_entry.glsl"

uniform sampler2D table;   // of the bake, row after row, over as many texels as needed
uniform float scale;
uniform sampler2D before;  // sums of exchanges of light
uniform sampler2D after;
uniform sampler2D gather;
uniform sampler2D albedo;  // of each surfel now, and of the bake
uniform int rank;          // 0 without bounces

out vec4 repainted;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    int index = at.y * textureSize(gather, 0).x + at.x;
    int width = textureSize(table, 0).x;
    vec3 kept = texelFetch(table, ivec2(index % width, index / width), 0).rgb * scale;
    repainted = vec4(kept + srbfRepaintedEntry(before, after, gather, albedo, rank, 1.0, at), 1.0);
}
