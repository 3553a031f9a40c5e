// SPDX-License-Identifier: MIT
#version 330 core
// The multi-pass variant for coefficient maps: a few plain textures of four components per pass, many passes, projected weights as
// in eigen_map_projected.frag. Blend ONE, ONE into a float target. SRBF_UNITS is 1 to 8; a sampler array takes constant indices only.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;

#ifndef SRBF_UNITS
#define SRBF_UNITS 5
#endif

uniform sampler2D planes[SRBF_UNITS];
uniform vec4 weights[3 * SRBF_UNITS];
uniform vec3 offset;

layout(location = 0) out vec4 response;

vec3 term(vec4 stored, vec4 red, vec4 green, vec4 blue) {
    return vec3(dot(stored, red), dot(stored, green), dot(stored, blue));
}

#define SRBF_TERM(i) term(textureLod(planes[i], uv, 0.0), weights[3 * i], weights[3 * i + 1], weights[3 * i + 2])

void main() {
    vec2 uv = gl_FragCoord.xy / vec2(textureSize(planes[0], 0));
    vec3 sum = offset + SRBF_TERM(0);
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
