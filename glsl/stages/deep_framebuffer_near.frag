// SPDX-License-Identifier: MIT
#version 330 core
// Light from a group of bright surfels on receivers that see it through one face of a cube about it: the arithmetic of
// srbf.visibility.near_sources. Blend ONE, ONE into a float target of one texel for each receiver.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "lights/light_vector.glsl"
#include "shadow/cube_face.glsl"
#include "shadow/point_shadow_place.glsl"
#include "surfels/disc_factor.glsl"
#include "surfels/surfel_visibility.glsl"

uniform sampler2D receivers;  // place, meters
uniform sampler2D normals;
uniform sampler2D heights;    // one over the depth of the nearest occluder
uniform sampler2D sources;    // rows: place and area, normal, radiosity, of one surfel a column
uniform int first;            // column of the group's first surfel
uniform int count;
uniform vec3 position;        // of the cube
uniform vec3 positionLow;
uniform vec3 across;
uniform vec3 up;
uniform vec3 ahead;
uniform float reach;
uniform float lift;           // meters: of a receiver above its surface, where its shadow is looked up
uniform int cubeFace;

layout(location = 0) out vec4 irradiance;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec3 place = texelFetch(receivers, at, 0).xyz;
    vec3 normal = texelFetch(normals, at, 0).xyz;
    vec3 fromCube = -srbfLightVector(position, positionLow, place + lift * normal);
    if (srbfCubeFace(fromCube) != cubeFace) {
        discard;
    }
    vec3 total = vec3(0.0);
    for (int i = first; i < first + count; ++i) {
        vec4 source = texelFetch(sources, ivec2(i, 0), 0);
        float factor = srbfDiscFactor(source.xyz - place, normal, texelFetch(sources, ivec2(i, 1), 0).xyz, source.w);
        total += factor * texelFetch(sources, ivec2(i, 2), 0).rgb;
    }
    if (total != vec3(0.0)) {
        total *= srbfSurfelVisibility(heights, ivec2(0), textureSize(heights, 0).x, srbfPointShadowPlace(fromCube, across, up, ahead, reach));
    }
    irradiance = vec4(total, 1.0);
}
