// SPDX-License-Identifier: MIT
#version 330 core
// One triangle over the whole target: corners (-1, -1), (3, -1), (-1, 3).
precision highp float;

layout(location = 0) in vec2 corner;

void main() {
    gl_Position = vec4(corner, 0.0, 1.0);
}
