// SPDX-License-Identifier: MIT
#version 330 core
// Direct light of one sun on the receivers: N.L times visibility by a shadow map, times the transmittance of the walls above. Irradiance.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "combine/direct.glsl"
#ifdef SRBF_LOBES
#include "gloss/texel_lobe.glsl"
#endif
#include "shadow/shadow_fraction.glsl"
#include "shadow/shadow_place.glsl"

uniform sampler2D points;
uniform sampler2D normals;
uniform sampler2D heights;
uniform sampler2D transmittance;
uniform sampler2D wallHeights;
uniform vec3 across;
uniform vec3 up;
uniform vec3 toLight;
uniform vec2 low;
uniform float extent;
uniform float weight;
#ifdef SRBF_LOBES
uniform sampler2D glossy;      // whole albedo of each texel's lobe
uniform sampler2D lobes;       // its roughness, what share of it has a Fresnel term, above 0 where there is one
uniform sampler2D lobeAlbedo;  // as srbfLobeAlbedo takes it
uniform vec4 eye;              // a place, less the same origin as the points, and 1; or the unit direction to it, and 0
#endif

layout(location = 0) out vec4 response;

const float STEEPEST = 16.0;  // meters per meter: a steeper receiver's plane is ignored
const float BIAS = 0.5;       // map texels

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec3 normal = texelFetch(normals, at, 0).xyz;
    vec3 point = texelFetch(points, at, 0).xyz;
    vec3 place = srbfShadowPlace(point, across, up, toLight, low, extent);
    float step = extent / float(textureSize(heights, 0).x);
    float NoL = max(dot(normal, toLight), 1.0 / STEEPEST);
    vec2 slope = clamp(-vec2(dot(normal, across), dot(normal, up)) / NoL, -STEEPEST, STEEPEST) * step;
    float bias = BIAS * step;
    vec3 visibility = vec3(srbfShadowFraction(heights, place.xy, place.z, slope, bias));
    float shaded = 1.0 - srbfShadowFraction(wallHeights, place.xy, place.z, slope, bias);
    visibility *= mix(vec3(1.0), textureLod(transmittance, place.xy, 0.0).rgb, shaded);
    response = vec4(srbfDirect(normal, toLight, visibility) * weight, 1.0);
#ifdef SRBF_LOBES
    response.rgb += srbfTexelLobe(glossy, lobes, lobeAlbedo, at, point, normal, eye, toLight, 0.0) * visibility * weight;
#endif
}
