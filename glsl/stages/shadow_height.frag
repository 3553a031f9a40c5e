// SPDX-License-Identifier: MIT
#version 330 core
// The height of the scene towards the light. Blend MAX, MAX into a float target cleared to a very low height.
precision highp float;

in vec3 wallNormal;
in float height;

layout(location = 0) out vec4 highest;

void main() {
    highest = vec4(height);
}
