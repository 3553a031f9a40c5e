// SPDX-License-Identifier: MIT
#version 330 core
// Direct light of one sun at points of the receivers' mesh: N.L times visibility by a shadow map, times the transmittance of the walls
// above. Irradiance. Of nested maps, each adds to the points in its square and in no finer one.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "combine/direct.glsl"
#include "shadow/rounded_share.glsl"
#include "shadow/shadow_fraction.glsl"
#include "shadow/shadow_place.glsl"

uniform sampler2D points;   // a: weight in the texel's mean
uniform sampler2D normals;  // of shading; a: height of the rounded surface above its triangle, meters
uniform sampler2D faces;    // normals of the triangles
uniform sampler2D heights;
uniform sampler2D transmittance;
uniform sampler2D wallHeights;
uniform bool walls;  // whether any of the scene is translucent
uniform vec3 across;
uniform vec3 up;
uniform vec3 toLight;
uniform vec2 low;
uniform float extent;
uniform vec3 finer[4];  // squares of finer maps: corner and side, meters; side 0: none
uniform bool bounded;   // whether there are coarser maps
uniform float weight;

layout(location = 0) out vec4 response;

const float STEEPEST = 64.0;  // meters per meter: a steeper receiver's plane is ignored
const float BIAS = 0.5;       // map texels
const float BORDER = 4.0;     // map texels, for filtering

bool within(vec3 point, vec2 corner, float side) {
    float most = 0.5 - BORDER / float(textureSize(heights, 0).x);
    vec2 off = abs(srbfShadowPlace(point, across, up, toLight, corner, side).xy - 0.5);
    return max(off.x, off.y) < most;
}

void main() {
    response = vec4(0.0);
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 point = texelFetch(points, at, 0);
    if (bounded && !within(point.xyz, low, extent)) {
        return;
    }
    for (int i = 0; i < 4; ++i) {
        if (finer[i].z > 0.0 && within(point.xyz, finer[i].xy, finer[i].z)) {
            return;
        }
    }
    vec4 shading = texelFetch(normals, at, 0);
    vec3 normal = shading.xyz;
    vec3 face = texelFetch(faces, at, 0).xyz;
    float lifted = shading.a == 0.0 ? 0.0 : srbfRoundedShare(dot(normal, toLight), dot(face, toLight));
    vec3 place = srbfShadowPlace(point.xyz + normal * (shading.a * lifted), across, up, toLight, low, extent);
    vec3 plane = mix(face, normal, lifted);
    float step = extent / float(textureSize(heights, 0).x);
    vec2 slope = clamp(-vec2(dot(plane, across), dot(plane, up)) / max(dot(plane, toLight), 1.0 / STEEPEST), -STEEPEST, STEEPEST) * step;
    float bias = BIAS * step;
    vec3 visibility = vec3(srbfShadowFraction(heights, place.xy, place.z, slope, bias));
    if (walls) {
        float shaded = 1.0 - srbfShadowFraction(wallHeights, place.xy, place.z, slope, bias);
        visibility *= mix(vec3(1.0), textureLod(transmittance, place.xy, 0.0).rgb, shaded);
    }
    response = vec4(srbfDirect(normal, toLight, visibility) * (weight * point.a), 1.0);
}
