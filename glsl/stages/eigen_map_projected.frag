// SPDX-License-Identifier: MIT
#version 330 core
// All directional and environment lights in one pass over coefficient maps, by projected weights, which include the decoding.
// Blend ONE, ONE into a float target.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;

#include "combine/components_projected.glsl"

uniform sampler2DArray planes;
uniform int firstLayer;
uniform vec4 weights[3 * SRBF_LAYERS];
uniform vec3 offset;

layout(location = 0) out vec4 response;

void main() {
    vec2 uv = gl_FragCoord.xy / vec2(textureSize(planes, 0).xy);
    response = vec4(srbfCombineComponentsProjected(planes, uv, 0.0, firstLayer, weights, offset), 1.0);
}
