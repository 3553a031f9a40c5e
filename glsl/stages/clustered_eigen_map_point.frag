// SPDX-License-Identifier: MIT
#version 330 core
// One point or spot light per pass over coefficient maps of clusters, each receiver with its own light vector and weights.
// Blend ONE, ONE into a float target.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;

#include "methods/clustered_eigen_map.glsl"

uniform sampler2DArray planes;
uniform sampler2D clusters;
uniform sampler2D positions;
uniform sampler2D wTable;
uniform int tableSize;
uniform int firstLayer;
uniform vec4 scale[SRBF_LAYERS];
uniform vec4 bias[SRBF_LAYERS];
uniform SrbfPointLight pointLight;

layout(location = 0) out vec4 response;

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy);
    vec3 receiver = texelFetch(positions, texel, 0).xyz;
    response = vec4(srbfClusteredPoint(planes, clusters, texel, firstLayer, wTable, tableSize, scale, bias, receiver, pointLight), 1.0);
}
