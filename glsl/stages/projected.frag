// SPDX-License-Identifier: MIT
#version 330 core
// All directional and environment lights in one pass over a texture array, by projected weights, which include the decoding.
// Blend ONE, ONE into a float target.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;

#include "combine/projected.glsl"

uniform sampler2DArray maps;
uniform int firstMap;
uniform vec4 weights[SRBF_K];
uniform vec3 offset;

layout(location = 0) out vec4 response;

void main() {
    vec2 uv = gl_FragCoord.xy / vec2(textureSize(maps, 0).xy);
    response = vec4(srbfCombineProjected(maps, uv, 0.0, firstMap, weights, offset), 1.0);
}
