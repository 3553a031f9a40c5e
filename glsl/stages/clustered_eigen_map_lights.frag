// SPDX-License-Identifier: MIT
#version 330 core
// All lights in one pass over coefficient maps of clusters: directional, environments and up to SRBF_POINT_LIGHTS points and spots.
// Receivers' positions are read from a map or, with SRBF_DEPTH, rebuilt from a camera's depth buffer. Blend ONE, ONE into a float target.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;

#ifdef SRBF_DEPTH
#include "depth/receiver_from_depth.glsl"
#endif
#include "methods/clustered_eigen_map_lights.glsl"

uniform sampler2DArray planes;
uniform sampler2D clusters;
uniform sampler2D weights;
uniform sampler2D wTable;
uniform int tableSize;
uniform int firstLayer;
uniform vec4 scale[SRBF_LAYERS];
uniform vec4 bias[SRBF_LAYERS];
#ifdef SRBF_DEPTH
uniform sampler2D depths;  // row 0 at the top, as in every file
uniform SrbfCamera camera;
#else
uniform sampler2D positions;
#endif
uniform vec4 pointLights[4 * SRBF_POINT_LIGHTS];
uniform int pointLightCount;

layout(location = 0) out vec4 response;

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy);
    vec2 uv = gl_FragCoord.xy / vec2(textureSize(planes, 0).xy);
#ifdef SRBF_DEPTH
    vec2 place = vec2(2.0, -2.0) * uv + vec2(-1.0, 1.0);
    vec3 receiver = srbfReceiverFromDepth(texelFetch(depths, texel, 0).r, place, camera);
#else
    vec3 receiver = texelFetch(positions, texel, 0).xyz;
#endif
    vec3 sum = srbfClusteredLights(planes, clusters, texel, firstLayer, weights, wTable, tableSize, scale, bias, receiver,
                                   pointLights, pointLightCount);
    response = vec4(sum, 1.0);
}
