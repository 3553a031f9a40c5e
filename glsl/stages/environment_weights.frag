// SPDX-License-Identifier: MIT
#version 330 core
// The weights of an environment in one row: of relighting maps, or of the Gaussians of a light basis. RGBA32F; blend ONE, ONE over the
// weights of directional lights.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;

uniform sampler2D rows;  // of environment_rows.frag
uniform vec3 color;

layout(location = 0) out vec4 weight;

void main() {
    vec3 sum = vec3(0.0);
    for (int row = 0; row < textureSize(rows, 0).y; ++row) {
        sum += texelFetch(rows, ivec2(int(gl_FragCoord.x), row), 0).rgb;
    }
    weight = vec4(color * sum, 1.0);
}
