// SPDX-License-Identifier: MIT
#version 330 core
// The light of one more light source on the view clusters, in its color, added to that of those before.
precision highp float;
precision highp int;
precision highp sampler2D;

uniform sampler2D former;
uniform sampler2D light;
uniform vec3 color;

layout(location = 0) out vec4 irradiance;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    irradiance = vec4(texelFetch(former, at, 0).rgb + color * texelFetch(light, at, 0).rgb, 1.0);
}
