// SPDX-License-Identifier: MIT
#version 330 core
// Up to SRBF_POINT_LIGHTS point and spot lights in one pass over a neural map. Receivers' positions are read from a map or, with
// SRBF_DEPTH, rebuilt from a camera's depth buffer. Blend ONE, ONE into a float target.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;

#ifdef SRBF_DEPTH
#include "depth/receiver_from_depth.glsl"
#endif
#include "methods/neural_map.glsl"

uniform sampler2DArray planes;
uniform vec4 network[SRBF_NETWORK];
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
    vec4 units[SRBF_UNIT_VECTORS];
    srbfNeuralCodes(planes, uv, 0.0, network, scale, bias, units);
    response = vec4(srbfNeuralMapPoints(units, network, receiver, pointLights, pointLightCount), 1.0);
}
