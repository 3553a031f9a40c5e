// SPDX-License-Identifier: MIT
#version 330 core
// Direct light of one point or spot light on the receivers that it sees through one map: N.L times attenuation, cone and visibility, times the
// transmittance of the walls between. Irradiance.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "combine/direct.glsl"
#include "lights/light_vector.glsl"
#include "lights/point_light_strength.glsl"
#include "shadow/cube_face.glsl"
#include "shadow/point_shadow_place.glsl"
#include "shadow/shadow_fraction.glsl"

uniform sampler2D points;
uniform sampler2D normals;
uniform sampler2D heights;  // one over the depth
uniform sampler2D transmittance;
uniform sampler2D wallHeights;
uniform SrbfPointLight pointLight;
uniform vec3 across;
uniform vec3 up;
uniform vec3 ahead;
uniform float reach;
uniform int face;         // of a cube; -1: the map holds all that the light shines on
uniform float lambertian; // 1: a part of an area that shines towards the light's axis, by the cosine to it; 0: a point or spot light
uniform float weight;

layout(location = 0) out vec4 response;

const float STEEPEST = 16.0;  // meters per meter: a steeper receiver's plane is ignored
const float BIAS = 0.5;       // map texels

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec3 normal = texelFetch(normals, at, 0).xyz;
    vec3 lightVector = srbfLightVector(pointLight.position, pointLight.positionLow, texelFetch(points, at, 0).xyz);
    vec3 fromLight = -lightVector;
    bool seen = face < 0 ? dot(fromLight, ahead) > 0.0 : srbfCubeFace(fromLight) == face;
    if (!seen) {
        discard;
    }
    vec3 toLight = srbfLightDirection(lightVector);
    float strength = srbfPointLightStrength(pointLight, lightVector) * mix(1.0, max(dot(-toLight, pointLight.axis), 0.0), lambertian);
    vec3 place = srbfPointShadowPlace(fromLight, across, up, ahead, reach);
    float step = 2.0 * reach / float(textureSize(heights, 0).x);  // of a map texel, at depth 1
    float NoL = max(dot(normal, toLight), 1.0 / STEEPEST);
    vec2 slope = -vec2(dot(normal, across), dot(normal, up)) / (NoL * max(length(lightVector), 1e-20)) * step;
    float bias = BIAS * step * place.z;
    vec3 visibility = vec3(srbfShadowFraction(heights, place.xy, place.z, slope, bias));
    float shaded = 1.0 - srbfShadowFraction(wallHeights, place.xy, place.z, slope, bias);
    visibility *= mix(vec3(1.0), textureLod(transmittance, place.xy, 0.0).rgb, shaded);
    response = vec4(srbfDirect(normal, toLight, visibility) * strength * weight, 1.0);
}
