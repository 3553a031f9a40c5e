// SPDX-License-Identifier: MIT
#version 330 core
// One point or spot light per pass, each receiver with its own light vector [Wong2005, fig. 8]. Blend ONE, ONE into a float target.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;

#include "methods/relighting_map.glsl"

uniform sampler2DArray maps;
uniform sampler2D positions;
uniform sampler2D rTable;
uniform int firstMap;
uniform vec4 centers[SRBF_K];
uniform vec4 scale[SRBF_K];
uniform vec4 bias[SRBF_K];
uniform SrbfPointLight pointLight;

layout(location = 0) out vec4 response;

void main() {
    vec2 uv = gl_FragCoord.xy / vec2(textureSize(maps, 0).xy);
    vec3 receiver = texelFetch(positions, ivec2(gl_FragCoord.xy), 0).xyz;
    response = vec4(srbfRelightPoint(maps, uv, firstMap, rTable, centers, scale, bias, receiver, pointLight), 1.0);
}
