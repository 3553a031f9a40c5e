// SPDX-License-Identifier: MIT
#version 330 core
// The weights of an environment for coefficient maps, from those of the light basis: as wide as a cluster has functions, one row
// per cluster. RGBA32F; blend ONE, ONE over the weights of directional lights.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;

#include "combine/environment_function.glsl"

uniform sampler2D gaussians;     // of environment_weights.frag
uniform sampler2D coefficients;  // light_coefficients.exr, the number of the spread in alpha
uniform int functions;           // a cluster: components + 1

layout(location = 0) out vec4 weight;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    weight = vec4(srbfCombineEnvironmentFunction(gaussians, coefficients, at.y * functions + at.x), 1.0);
}
