// SPDX-License-Identifier: MIT
#version 330 core
// What one material's walls let through. Blend DST_COLOR, ZERO (a product) into a float target cleared to 1.
precision highp float;

#include "shadow/transmittance.glsl"

uniform vec4 curve[8];
uniform vec3 toLight;

in vec3 wallNormal;
in float height;

layout(location = 0) out vec4 passed;

void main() {
    passed = vec4(srbfTransmittance(curve, dot(normalize(wallNormal), toLight)), 1.0);
}
