// SPDX-License-Identifier: MIT
#version 330 core
// A triangle of the scene as a point light sees it through one perspective map: a face of a cube about it, or a spot's cone.
precision highp float;

uniform vec3 light;
uniform vec3 across;
uniform vec3 up;
uniform vec3 ahead;
uniform float reach;    // tangent of the map's half-angle
uniform float nearest;  // meters: what is nearer along `ahead` casts no shadow

layout(location = 0) in vec3 corner;
layout(location = 1) in vec3 cornerNormal;

out vec3 wallNormal;
out vec3 lightVector;

void main() {
    vec3 fromLight = corner - light;
    float depth = dot(fromLight, ahead);
    wallNormal = cornerNormal;
    lightVector = -fromLight;
    gl_Position = vec4(vec2(dot(fromLight, across), dot(fromLight, up)) / reach, depth - 2.0 * nearest, depth);
}
