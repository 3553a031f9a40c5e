// SPDX-License-Identifier: MIT
#version 330 core
// How much receivers see of a place on a surface, 0 to 1, of those that are seen through one face of a cube about it; others keep what they
// have. For each cell of bright surfels once: the result does not depend on any light.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "lights/light_vector.glsl"
#include "shadow/cube_face.glsl"
#include "shadow/point_shadow_place.glsl"
#include "surfels/surfel_visibility.glsl"

uniform sampler2D receivers;  // place, meters
uniform sampler2D normals;
uniform sampler2D heights;    // one over the depth of the nearest occluder
uniform int first;            // row of the target's texels for the first row of receivers
uniform vec3 position;        // of the cube
uniform vec3 positionLow;
uniform vec3 across;
uniform vec3 up;
uniform vec3 ahead;
uniform float reach;
uniform float lift;           // meters: of a receiver above its surface, where its shadow is looked up
uniform int cubeFace;

layout(location = 0) out vec4 visible;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy) - ivec2(0, first);
    vec3 place = texelFetch(receivers, at, 0).xyz;
    vec3 fromCube = -srbfLightVector(position, positionLow, place + lift * texelFetch(normals, at, 0).xyz);
    if (srbfCubeFace(fromCube) != cubeFace) {
        discard;
    }
    visible = vec4(srbfSurfelVisibility(heights, ivec2(0), textureSize(heights, 0).x, srbfPointShadowPlace(fromCube, across, up, ahead, reach)));
}
