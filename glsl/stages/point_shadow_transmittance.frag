// SPDX-License-Identifier: MIT
#version 330 core
// What one material's walls let through of a point light. Blend DST_COLOR, ZERO (a product) into a float target cleared to 1.
precision highp float;

#include "shadow/transmittance.glsl"

uniform vec4 curve[8];

in vec3 wallNormal;
in vec3 lightVector;

layout(location = 0) out vec4 passed;

void main() {
    passed = vec4(srbfTransmittance(curve, dot(normalize(wallNormal), normalize(lightVector))), 1.0);
}
