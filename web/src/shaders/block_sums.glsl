// SPDX-License-Identifier: MIT
// The parts that table_sums.glsl leaves of every row, added up, and what `added` holds besides.
precision highp float;
precision highp int;
precision highp sampler2D;

uniform sampler2D parts;
uniform sampler2D added;
uniform int blocks;
uniform int width;  // of the target

out vec4 sum;

void main() {
    int index = int(gl_FragCoord.y) * width + int(gl_FragCoord.x);
    int partsWidth = textureSize(parts, 0).x;
    vec3 total = texelFetch(added, ivec2(gl_FragCoord.xy), 0).rgb;
    for (int i = index * blocks; i < (index + 1) * blocks; ++i) {
        total += texelFetch(parts, ivec2(i % partsWidth, i / partsWidth), 0).rgb;
    }
    sum = vec4(total, 1.0);
}
