// SPDX-License-Identifier: MIT
// What every patch reflects: its mean irradiance, by area, over its cells, which follow each other, times its reflectance.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "surfels/patch_mean.glsl"

uniform sampler2D irradiance;
uniform sampler2D normals;  // share of the patch's area in the last channel
uniform sampler2D ranges;   // first cell, how many
uniform sampler2D reflectance;

out vec4 mean;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    mean = vec4(srbfPatchMean(irradiance, normals, ranges, at) * texelFetch(reflectance, at, 0).rgb, 1.0);
}
