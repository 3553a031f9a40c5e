// SPDX-License-Identifier: MIT
#version 330 core
// The light of one more light source on the view clusters, in its color. Blend ONE, ONE into a float target.
precision highp float;
precision highp int;
precision highp sampler2D;

uniform sampler2D light;
uniform vec3 color;

layout(location = 0) out vec4 irradiance;

void main() {
    irradiance = vec4(color * texelFetch(light, ivec2(gl_FragCoord.xy), 0).rgb, 1.0);
}
