// SPDX-License-Identifier: MIT
#version 330 core
// One over the depth of the scene before a point light. Blend MAX, MAX into a float target cleared to 0.
precision highp float;

in vec3 wallNormal;
in vec3 lightVector;

layout(location = 0) out vec4 highest;

void main() {
    highest = vec4(gl_FragCoord.w);
}
