// SPDX-License-Identifier: MIT
#version 330 core
// The multi-pass variant for clusters: a few plain textures of four components per pass, the cluster and its row of weights, many passes,
// as in clustered_eigen_map_projected.frag. Blend ONE, ONE into a float target. SRBF_UNITS is 1 to 8, and two units more are taken.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;

#include "combine/cluster_index.glsl"

#ifndef SRBF_UNITS
#define SRBF_UNITS 5
#endif

uniform sampler2D planes[SRBF_UNITS];
uniform sampler2D clusters;
uniform int firstLayer;
uniform sampler2D weights;

layout(location = 0) out vec4 response;

vec3 term(vec4 stored, ivec2 at) {
    vec4 red = texelFetch(weights, at, 0);
    vec4 green = texelFetch(weights, at + ivec2(1, 0), 0);
    vec4 blue = texelFetch(weights, at + ivec2(2, 0), 0);
    return vec3(dot(stored, red), dot(stored, green), dot(stored, blue));
}

#define SRBF_TERM(i) term(texelFetch(planes[i], texel, 0), ivec2(3 * (firstLayer + i) + 1, cluster))

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy);
    int cluster = srbfClusterIndex(clusters, texel);
    vec3 offset = firstLayer == 0 ? texelFetch(weights, ivec2(0, cluster), 0).rgb : vec3(0.0);
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
