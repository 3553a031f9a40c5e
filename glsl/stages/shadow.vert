// SPDX-License-Identifier: MIT
#version 330 core
// A triangle of the scene as a sun sees it: the square (low, extent) about the receivers fills the target.
precision highp float;

#include "shadow/shadow_place.glsl"

uniform vec3 across;
uniform vec3 up;
uniform vec3 toLight;
uniform vec2 low;
uniform float extent;

layout(location = 0) in vec3 corner;
layout(location = 1) in vec3 cornerNormal;

out vec3 wallNormal;
out float height;

void main() {
    vec3 place = srbfShadowPlace(corner, across, up, toLight, low, extent);
    wallNormal = cornerNormal;
    height = place.z;
    gl_Position = vec4(place.xy * 2.0 - 1.0, 0.0, 1.0);
}
