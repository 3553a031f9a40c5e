// SPDX-License-Identifier: MIT
// The mean irradiance of every patch, by area, over its cells, which follow each other.
precision highp float;
precision highp int;
precision highp sampler2D;

uniform sampler2D irradiance;
uniform sampler2D normals;  // share of the patch's area in the last channel
uniform sampler2D ranges;   // first cell, how many

out vec4 mean;

void main() {
    ivec2 range = ivec2(texelFetch(ranges, ivec2(gl_FragCoord.xy), 0).xy + 0.5);
    int width = textureSize(irradiance, 0).x;
    vec3 total = vec3(0.0);
    for (int i = range.x; i < range.x + range.y; ++i) {
        ivec2 at = ivec2(i % width, i / width);
        total += texelFetch(normals, at, 0).w * texelFetch(irradiance, at, 0).rgb;
    }
    mean = vec4(total, 1.0);
}
