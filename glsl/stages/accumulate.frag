// SPDX-License-Identifier: MIT
#version 330 core
// The article's variant: a few plain textures per pass, many passes [Wong2005, "Directional-Source Shader"]. Blend ONE, ONE into a
// float target. SRBF_UNITS is 1 to 8; the terms are spelled out because a sampler array takes constant indices only.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;

#include "combine/decode.glsl"

#ifndef SRBF_UNITS
#define SRBF_UNITS 5
#endif

uniform sampler2D maps[SRBF_UNITS];
uniform vec4 weights[SRBF_UNITS];
uniform vec4 scale[SRBF_UNITS];
uniform vec4 bias[SRBF_UNITS];

layout(location = 0) out vec4 response;

#define SRBF_TERM(i) (weights[i].rgb * srbfDecode(textureLod(maps[i], uv, 0.0).rgb, scale[i].rgb, bias[i].rgb))

void main() {
    vec2 uv = gl_FragCoord.xy / vec2(textureSize(maps[0], 0));
    vec3 sum = SRBF_TERM(0);
#if SRBF_UNITS > 1
    sum += SRBF_TERM(1);
#endif
#if SRBF_UNITS > 2
    sum += SRBF_TERM(2);
#endif
#if SRBF_UNITS > 3
    sum += SRBF_TERM(3);
#endif
#if SRBF_UNITS > 4
    sum += SRBF_TERM(4);
#endif
#if SRBF_UNITS > 5
    sum += SRBF_TERM(5);
#endif
#if SRBF_UNITS > 6
    sum += SRBF_TERM(6);
#endif
#if SRBF_UNITS > 7
    sum += SRBF_TERM(7);
#endif
    response = vec4(sum, 1.0);
}
