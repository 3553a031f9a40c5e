// SPDX-License-Identifier: MIT
#version 330 core
// Irradiance of the view clusters from what the surfels reflect: E = W B.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "surfels/linked_light.glsl"

uniform sampler2D links;
uniform sampler2D rows;
uniform sampler2D light;  // B
uniform float rays;

layout(location = 0) out vec4 irradiance;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    irradiance = vec4(srbfLinkedLight(links, rows, light, at.y * textureSize(rows, 0).x + at.x, rays), 1.0);
}
