// SPDX-License-Identifier: MIT
#version 330 core
// max(0, sum over lights) + ambient, once, after every other pass. No ambient: a 1 x 1 black texture.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;

#include "combine/finish.glsl"

uniform sampler2D sum;
uniform sampler2D ambient;

layout(location = 0) out vec4 relit;

void main() {
    vec2 uv = gl_FragCoord.xy / vec2(textureSize(sum, 0));
    relit = vec4(srbfFinish(textureLod(sum, uv, 0.0).rgb, textureLod(ambient, uv, 0.0).rgb), 1.0);
}
