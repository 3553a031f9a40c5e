// SPDX-License-Identifier: MIT
// How much receivers see of a cell of bright surfels, 0 to 1.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "cube_visibility.glsl"

uniform sampler2D places;    // less the middle of all cells, meters
uniform sampler2D normals;
uniform sampler2D nearness;  // six faces of a cube about the cell's place
uniform vec3 light;          // that place, less that middle
uniform float lift;          // meters: of a receiver above its surface, where it is seen
uniform int first;           // row of the target's texels for the first row of receivers

out vec4 seen;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy) - ivec2(0, first);
    seen = vec4(cubeVisibility(nearness, texelFetch(places, at, 0).xyz + lift * texelFetch(normals, at, 0).xyz - light));
}
