// SPDX-License-Identifier: MIT
#version 330 core
// Direct irradiance of one point of a light on the surfels that it sees through one face of a cube, or a spot's one map: the arithmetic of
// srbf.visibility.received. Blend ONE, ONE into a float target of a texel per surfel.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "surfels/cell_irradiance.glsl"
#include "surfels/profiled_irradiance.glsl"
#include "shadow/cube_face.glsl"
#include "shadow/point_shadow_place.glsl"
#include "surfels/surfel_visibility.glsl"

uniform sampler2D surfels;  // place, meters; area
uniform sampler2D normals;
uniform sampler2D heights;  // one over the depth of the nearest occluder
uniform sampler2D profile;
uniform bool profiled;      // whether the light has one
uniform vec3 profileAcross;
uniform vec3 profileUp;
uniform float profileTangent;
uniform SrbfPointLight pointLight;
uniform vec3 across;
uniform vec3 up;
uniform vec3 ahead;
uniform float reach;
uniform float lift;         // meters: of a surfel above its surface, where its shadow is looked up
uniform int cubeFace;       // -1: one map
uniform float lambertian;   // 1: a part of an area, by the cosine to the light's axis; 0: a point or spot light
uniform float weight;

layout(location = 0) out vec4 irradiance;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 cell = texelFetch(surfels, at, 0);
    vec3 normal = texelFetch(normals, at, 0).xyz;
    vec3 fromLight = -srbfLightVector(pointLight.position, pointLight.positionLow, cell.xyz + lift * normal);
    if (cubeFace >= 0 ? srbfCubeFace(fromLight) != cubeFace : dot(fromLight, ahead) <= 0.0) {
        discard;
    }
    vec3 amount = vec3(0.0);
    if (profiled) {
        amount = srbfProfiledIrradiance(cell, normal, pointLight, profile, profileAcross, profileUp, profileTangent);
    } else {
        amount = vec3(srbfCellIrradiance(cell, normal, pointLight, lambertian));
    }
    if (amount.r + amount.g + amount.b > 0.0) {
        vec3 place = srbfPointShadowPlace(fromLight, across, up, ahead, reach);
        place.xy = clamp(place.xy, 0.0, 1.0);  // of a surfel whose middle is past the cone
        amount *= srbfSurfelVisibility(heights, ivec2(0), textureSize(heights, 0).x, place);
    }
    irradiance = vec4(amount * weight, 1.0);
}
