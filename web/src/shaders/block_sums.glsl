// SPDX-License-Identifier: MIT
// The parts that table_sums.glsl leaves of every row, added up, and what `added` holds besides.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "surfels/block_sum.glsl"

uniform sampler2D parts;
uniform sampler2D added;
uniform int blocks;
uniform int width;  // of the target

out vec4 sum;

void main() {
    int index = int(gl_FragCoord.y) * width + int(gl_FragCoord.x);
    sum = vec4(srbfBlockSum(parts, blocks, index) + texelFetch(added, ivec2(gl_FragCoord.xy), 0).rgb, 1.0);
}
