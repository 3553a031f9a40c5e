// SPDX-License-Identifier: MIT
#version 330 core
// Up to SRBF_DISTANT lights at infinity in one pass over a neural map. Blend ONE, ONE into a float target.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;

#include "methods/neural_map.glsl"

uniform sampler2DArray planes;
uniform vec4 network[SRBF_NETWORK];
uniform vec4 scale[SRBF_LAYERS];
uniform vec4 bias[SRBF_LAYERS];
uniform vec4 distant[2 * SRBF_DISTANT];
uniform int distantCount;

layout(location = 0) out vec4 response;

void main() {
    vec2 uv = gl_FragCoord.xy / vec2(textureSize(planes, 0).xy);
    vec4 units[SRBF_UNIT_VECTORS];
    srbfNeuralCodes(planes, uv, 0.0, network, scale, bias, units);
    response = vec4(srbfNeuralMapDistant(units, network, distant, distantCount), 1.0);
}
