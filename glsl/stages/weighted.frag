// SPDX-License-Identifier: MIT
#version 330 core
// All directional and environment lights in one pass over a texture array, weights from a texture. Blend ONE, ONE into a float
// target.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;

#include "combine/weighted.glsl"

uniform sampler2DArray maps;
uniform int firstMap;
uniform sampler2D weights;
uniform vec4 scale[SRBF_K];
uniform vec4 bias[SRBF_K];

layout(location = 0) out vec4 response;

void main() {
    vec2 uv = gl_FragCoord.xy / vec2(textureSize(maps, 0).xy);
    response = vec4(srbfCombineWeighted(maps, uv, 0.0, firstMap, weights, scale, bias), 1.0);
}
