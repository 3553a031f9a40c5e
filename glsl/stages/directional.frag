// SPDX-License-Identifier: MIT
#version 330 core
// All directional and environment lights in one pass over a texture array [Wong2005, fig. 6]. Blend ONE, ONE into a float target.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;

#include "methods/relighting_map.glsl"

uniform sampler2DArray maps;
uniform int firstMap;
uniform vec4 weights[SRBF_K];
uniform vec4 scale[SRBF_K];
uniform vec4 bias[SRBF_K];

layout(location = 0) out vec4 response;

void main() {
    vec2 uv = gl_FragCoord.xy / vec2(textureSize(maps, 0).xy);
    response = vec4(srbfRelightDirectional(maps, uv, firstMap, weights, scale, bias), 1.0);
}
