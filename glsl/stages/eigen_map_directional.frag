// SPDX-License-Identifier: MIT
#version 330 core
// All directional and environment lights in one pass over coefficient maps. Blend ONE, ONE into a float target.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;

#include "methods/eigen_map.glsl"

uniform sampler2DArray planes;
uniform int firstLayer;
uniform sampler2D weights;
uniform vec4 scale[SRBF_LAYERS];
uniform vec4 bias[SRBF_LAYERS];

layout(location = 0) out vec4 response;

void main() {
    vec2 uv = gl_FragCoord.xy / vec2(textureSize(planes, 0).xy);
    response = vec4(srbfEigenMapDirectional(planes, uv, firstLayer, weights, scale, bias), 1.0);
}
