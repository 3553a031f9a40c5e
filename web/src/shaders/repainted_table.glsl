// SPDX-License-Identifier: MIT
// An asset's table with other albedo: what the changed surfaces reflect in place of the former ones.
precision highp float;
precision highp int;
precision highp sampler2D;

uniform sampler2D table;  // row after row, over as many texels as needed
uniform float scale;
uniform sampler2D before;
uniform sampler2D after;

out vec4 repainted;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    int index = at.y * textureSize(after, 0).x + at.x;
    int width = textureSize(table, 0).x;
    vec3 kept = texelFetch(table, ivec2(index % width, index / width), 0).rgb * scale;
    repainted = vec4(kept + texelFetch(after, at, 0).rgb - texelFetch(before, at, 0).rgb, 1.0);
}
