// SPDX-License-Identifier: MIT
#version 330 core
// All directional and environment lights in one pass over coefficient maps of clusters, by projected weights, which include the decoding.
// Blend ONE, ONE into a float target.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;

#include "combine/cluster_index.glsl"
#include "combine/components_projected_cluster.glsl"

uniform sampler2DArray planes;
uniform sampler2D clusters;
uniform int firstLayer;
uniform sampler2D weights;

layout(location = 0) out vec4 response;

void main() {
    vec2 uv = gl_FragCoord.xy / vec2(textureSize(planes, 0).xy);
    int cluster = srbfClusterIndex(clusters, ivec2(gl_FragCoord.xy));
    response = vec4(srbfCombineComponentsProjectedCluster(planes, uv, firstLayer, weights, cluster), 1.0);
}
