// SPDX-License-Identifier: MIT
#version 330 core
// A pixel's light from its view clusters, in the asset's quantity. Blend ONE, ONE into a float target.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;

#include "methods/deep_framebuffer.glsl"

uniform sampler2DArray neighbors;
uniform int layers;
uniform sampler2D light;
uniform sampler2D reflectance;  // albedo / pi, or one texel of 1 for irradiance

layout(location = 0) out vec4 response;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec3 reflected = texelFetch(reflectance, min(at, textureSize(reflectance, 0) - 1), 0).rgb;
    response = vec4(reflected * srbfNeighborLight(neighbors, 0, layers, light, at), 1.0);
}
