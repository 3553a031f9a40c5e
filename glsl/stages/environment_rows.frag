// SPDX-License-Identifier: MIT
#version 330 core
// An environment's weights, row by row of the map: the target is as wide as there are centers and as high as the map, RGBA32F. The sum of
// its rows is taken by environment_weights.frag. Coefficient maps need SRBF_FORMULA; their centers are repeated for each spread.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;

#include "combine/environment_row.glsl"

uniform sampler2D environment;  // row 0 towards +z
uniform sampler2D centers;      // RGBA32F, one row: center, and 1 / (2 spread^2) in alpha
uniform sampler2D rTable;
uniform vec4 assetFromMap[3];
uniform int domain;

layout(location = 0) out vec4 part;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    part = vec4(srbfCombineEnvironmentRow(environment, at.y, rTable, texelFetch(centers, ivec2(at.x, 0), 0), assetFromMap, domain), 1.0);
}
