// SPDX-License-Identifier: MIT
#version 330 core
// A finished image of light into the sum, such as the direct light of an indirect asset. Blend ONE, ONE into a float target.
precision highp float;
precision highp int;
precision highp sampler2D;

uniform sampler2D light;

layout(location = 0) out vec4 response;

void main() {
    response = vec4(texelFetch(light, ivec2(gl_FragCoord.xy), 0).rgb, 1.0);
}
