// SPDX-License-Identifier: MIT
// The mean irradiance of every patch, by area, over its cells, which follow each other.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "surfels/patch_mean.glsl"

uniform sampler2D irradiance;
uniform sampler2D normals;  // share of the patch's area in the last channel
uniform sampler2D ranges;   // first cell, how many

out vec4 mean;

void main() {
    mean = vec4(srbfPatchMean(irradiance, normals, ranges, ivec2(gl_FragCoord.xy)), 1.0);
}
