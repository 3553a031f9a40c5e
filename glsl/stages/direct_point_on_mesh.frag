// SPDX-License-Identifier: MIT
#version 330 core
// Direct light of one point or spot light, or of one point of a light with a size, at points of the receivers' mesh: N.L times strength
// times visibility by a perspective shadow map, times the transmittance of the walls between. Irradiance; a: the same without shadows.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "lights/light_vector.glsl"
#include "lights/point_light_strength.glsl"
#include "lights/profile.glsl"
#include "shadow/cube_face.glsl"
#include "shadow/point_shadow_place.glsl"
#include "shadow/point_shadow_slope.glsl"
#include "shadow/rounded_share.glsl"
#include "shadow/shadow_fraction.glsl"

uniform sampler2D points;   // a: weight in the texel's mean
uniform sampler2D normals;  // of shading; a: height of the rounded surface above its triangle, meters
uniform sampler2D faces;    // normals of the triangles
uniform sampler2D heights;  // one over the depth
uniform sampler2D transmittance;
uniform sampler2D wallHeights;
uniform sampler2D profile;
uniform bool profiled;  // whether the light has a profile
uniform vec3 profileAcross;
uniform vec3 profileUp;
uniform float profileTangent;
uniform bool walls;  // whether any of the scene is translucent
uniform SrbfPointLight pointLight;
uniform vec3 facing;  // normal of a surface that glows, at this point of it; 0 for a point or spot light
uniform vec3 across;
uniform vec3 up;
uniform vec3 ahead;
uniform vec3 cubeX;
uniform vec3 cubeY;
uniform vec3 cubeZ;
uniform float reach;
uniform int cubeFace;  // that the map shows; -1: the map holds all that the light shines on
uniform float weight;

layout(location = 0) out vec4 response;

const float STEEPEST = 256.0;  // meters per meter: a steeper receiver's plane is ignored
const float BIAS = 0.5;       // map texels

void main() {
    response = vec4(0.0);
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 point = texelFetch(points, at, 0);
    vec3 lightVector = srbfLightVector(pointLight.position, pointLight.positionLow, point.xyz);
    if (cubeFace >= 0 && srbfCubeFace(-vec3(dot(lightVector, cubeX), dot(lightVector, cubeY), dot(lightVector, cubeZ))) != cubeFace) {
        return;
    }
    vec4 shading = texelFetch(normals, at, 0);
    vec3 normal = shading.xyz;
    vec3 toLight = srbfLightDirection(lightVector);
    float NoL = dot(normal, toLight);
    float amount = max(NoL, 0.0) * srbfPointLightStrength(pointLight, lightVector) * weight * point.a;
    amount *= facing == vec3(0.0) ? 1.0 : -dot(facing, toLight);
    if (amount <= 0.0) {
        return;
    }
    vec3 face = texelFetch(faces, at, 0).xyz;
    float lifted = shading.a == 0.0 ? 0.0 : srbfRoundedShare(NoL, dot(face, toLight));
    vec3 fromLight = normal * (shading.a * lifted) - lightVector;
    vec3 place = srbfPointShadowPlace(fromLight, across, up, ahead, reach);
    float step = 2.0 * reach / float(textureSize(heights, 0).x);  // of a map texel, at depth 1
    vec2 slope = srbfPointShadowSlope(fromLight, mix(face, normal, lifted), across, up, STEEPEST * place.z) * step;
    float bias = BIAS * step * place.z;
    vec3 visibility = vec3(srbfShadowFraction(heights, place.xy, place.z, slope, bias));
    if (walls) {
        float shaded = 1.0 - srbfShadowFraction(wallHeights, place.xy, place.z, slope, bias);
        visibility *= mix(vec3(1.0), textureLod(transmittance, place.xy, 0.0).rgb, shaded);
    }
    if (profiled) {
        visibility *= srbfProfile(profile, -lightVector, pointLight.axis, profileAcross, profileUp, profileTangent);
    }
    response = vec4(visibility * amount, amount);
}
