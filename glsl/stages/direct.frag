// SPDX-License-Identifier: MIT
#version 330 core
// Direct light of one sun on the receivers: N.L times visibility by a shadow map, times the tint of the walls above. Irradiance.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "combine/direct.glsl"
#include "shadow/shadow_fraction.glsl"
#include "shadow/shadow_place.glsl"

uniform sampler2D points;
uniform sampler2D normals;
uniform sampler2D faces;
uniform sampler2D lifts;
uniform sampler2D heights;
uniform sampler2D tints;
uniform sampler2D wallHeights;
uniform vec3 across;
uniform vec3 up;
uniform vec3 toLight;
uniform vec2 low;
uniform float extent;
uniform float weight;

layout(location = 0) out vec4 answer;

const float STEEPEST = 1000.0;  // metres a metre: beyond it single precision holds no plane
const float BIAS = 0.5;         // map texels
const float TERMINATOR = 0.1;   // cosine below which light meets the rounded surface [Hanika2021], as Cycles has it by default

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec3 normal = texelFetch(normals, at, 0).xyz;
    vec3 face = texelFetch(faces, at, 0).xyz;
    float NoL = dot(normal, toLight);
    float NgL = dot(face, toLight);
    float rounded = clamp(NoL < TERMINATOR ? 2.0 - (NgL + NoL) / TERMINATOR : 1.0 - NgL / TERMINATOR, 0.0, 1.0);
    vec3 lift = texelFetch(lifts, at, 0).xyz * rounded;
    vec3 place = srbfShadowPlace(texelFetch(points, at, 0).xyz + lift, across, up, toLight, low, extent);
    float step = extent / float(textureSize(heights, 0).x);
    vec3 plane = NgL < NoL && dot(lift, lift) > 0.0 ? mix(face, normal, rounded) : face;
    vec2 slope = clamp(-vec2(dot(plane, across), dot(plane, up)) / max(dot(plane, toLight), 1.0 / STEEPEST), -STEEPEST, STEEPEST) * step;
    float bias = BIAS * step;
    vec3 visibility = vec3(srbfShadowFraction(heights, place.xy, place.z, slope, bias));
    float shaded = 1.0 - srbfShadowFraction(wallHeights, place.xy, place.z, slope, bias);
    visibility *= mix(vec3(1.0), textureLod(tints, place.xy, 0.0).rgb, shaded);
    answer = vec4(srbfDirect(normal, toLight, visibility) * weight, 1.0);
}
