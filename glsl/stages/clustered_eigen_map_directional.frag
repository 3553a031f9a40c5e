// SPDX-License-Identifier: MIT
#version 330 core
// All directional and environment lights in one pass over coefficient maps of clusters. Blend ONE, ONE into a float target.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;

#include "methods/clustered_eigen_map.glsl"

uniform sampler2DArray planes;
uniform sampler2D clusters;
uniform int firstLayer;
uniform sampler2D weights;
uniform vec4 scale[SRBF_LAYERS];
uniform vec4 bias[SRBF_LAYERS];

layout(location = 0) out vec4 response;

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy);
    response = vec4(srbfClusteredDirectional(planes, clusters, texel, firstLayer, weights, scale, bias), 1.0);
}
