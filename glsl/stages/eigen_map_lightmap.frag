// SPDX-License-Identifier: MIT
#version 330 core
// A surface lit by coefficient maps: directional lights, environments and up to SRBF_POINT_LIGHTS points and spots in one draw, finished.
// Its place in the lightmap and its position come from lightmap.vert. Irradiance assets: outgoing light = albedo * relit / pi.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;

#include "combine/mip_level.glsl"
#include "methods/eigen_map_lights.glsl"

uniform sampler2DArray planes;
uniform sampler2D weights;
uniform sampler2D wTable;
uniform int tableSize;
uniform vec4 scale[SRBF_LAYERS];
uniform vec4 bias[SRBF_LAYERS];
uniform vec4 pointLights[4 * SRBF_POINT_LIGHTS];
uniform int pointLightCount;
uniform sampler2D ambient;

in vec3 receiver;
in vec2 uv;

layout(location = 0) out vec4 relit;

void main() {
    vec2 place = uv * vec2(textureSize(planes, 0).xy);
    float level = srbfMipLevel(dFdx(place), dFdy(place));
    vec3 sum = srbfEigenMapLights(planes, uv, level, 0, weights, wTable, tableSize, scale, bias, receiver,
                                  pointLights, pointLightCount);
    relit = vec4(srbfFinish(sum, textureLod(ambient, uv, 0.0).rgb), 1.0);
}
