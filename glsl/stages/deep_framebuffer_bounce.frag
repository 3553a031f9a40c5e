// SPDX-License-Identifier: MIT
#version 330 core
// One bounce between the surfels: what each reflects of the direct light and of what the others reflect, rho (E + F B). The first has no others.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "surfels/linked_light.glsl"

uniform sampler2D links;
uniform sampler2D rows;
uniform sampler2D light;   // B, of the pass before
uniform sampler2D direct;  // E
uniform sampler2D albedo;
uniform float rays;
uniform int first;         // 1: B is 0

layout(location = 0) out vec4 radiosity;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec3 arriving = texelFetch(direct, at, 0).rgb;
    if (first == 0) {
        arriving += srbfLinkedLight(links, rows, light, at.y * textureSize(direct, 0).x + at.x, rays);
    }
    radiosity = vec4(texelFetch(albedo, at, 0).rgb * arriving, 1.0);
}
