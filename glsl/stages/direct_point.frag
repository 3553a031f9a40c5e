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
#include "lights/profile.glsl"
#include "shadow/cube_face.glsl"
#include "shadow/point_shadow_place.glsl"
#include "shadow/shadow_fraction.glsl"
#ifdef SRBF_LOBES
#include "gloss/texel_lobe.glsl"
#include "surfels/tangents.glsl"
#endif

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
uniform sampler2D profile;
uniform bool profiled;    // whether the light has a profile
uniform vec3 profileAcross;
uniform vec3 profileUp;
uniform float profileTangent;
uniform vec4 sphere;      // middle of a sphere, or of a spot with a size, less the origin of the points, and its radius; radius 0 otherwise
#ifdef SRBF_LOBES
uniform sampler2D glossy;      // whole albedo of each texel's lobe
uniform sampler2D lobes;       // its roughness, what share of it has a Fresnel term, above 0 where there is one
uniform sampler2D lobeAlbedo;  // as srbfLobeAlbedo takes it
uniform vec4 eye;              // a place, less the same origin as the points, and 1; or the unit direction to it, and 0
uniform vec3 partAcross;       // sides of the part of an area that the look stands for, meters; 0 otherwise
uniform vec3 partUp;
uniform int sphereLook;        // which of sphereLooks
uniform int sphereLooks;
#endif

layout(location = 0) out vec4 response;

const float STEEPEST = 16.0;  // meters per meter: a steeper receiver's plane is ignored
const float BIAS = 0.5;       // map texels
#ifdef SRBF_LOBES
const float ROUGH = 0.35;     // roughness from which fewer places of a light do
#endif

#ifdef SRBF_LOBES
// What the lobe reflects of the look's part of the light, nothing between: at several places of a light with a size, each as wide as its share.
vec3 reflected(ivec2 at, vec3 point, vec3 normal, vec3 lightVector) {
    const float GOLDEN_ANGLE = 2.39996323;
    float roughness = texelFetch(lobes, at, 0).r;
    int side = roughness < ROUGH ? 4 : 2;  // places per side of a part of an area
    int count = 1;
    float size = 0.0;  // of the piece of light about a place, meters across
    vec3 middle = lightVector;
    vec3 discAcross;  // of a sphere's disc, as the receiver sees it
    vec3 discUp;
    srbfTangents(srbfLightDirection(sphere.xyz - point), discAcross, discUp);
    if (sphere.w > 0.0) {
        count = side * side / 2;
        size = sphere.w * sqrt(3.14159265 / float(count * sphereLooks));
        middle = sphere.xyz - point;
    } else if (partAcross != vec3(0.0)) {
        count = side * side;
        size = sqrt(length(partAcross) * length(partUp)) / float(side);
    }
    vec3 total = vec3(0.0);
    for (int i = 0; i < count; ++i) {
        vec3 toPlace = middle;
        if (sphere.w > 0.0) {
            float number = float(i * sphereLooks + sphereLook) + 0.5;
            float away = sphere.w * sqrt(number / float(count * sphereLooks));
            toPlace += away * (cos(GOLDEN_ANGLE * number) * discAcross + sin(GOLDEN_ANGLE * number) * discUp);
        } else if (count > 1) {
            vec2 part = (vec2(float(i % side), float(i / side)) + 0.5) / float(side) - 0.5;
            toPlace += part.x * partAcross + part.y * partUp;
        }
        vec3 toLight = srbfLightDirection(toPlace);
        bool even = sphere.w > 0.0 && pointLight.versineOuter > 2.0;  // a sphere without a cone: what all of it gives at its distance
        float strength = srbfPointLightStrength(pointLight, even ? middle : toPlace) * mix(1.0, max(dot(-toLight, pointLight.axis), 0.0), lambertian);
        total += srbfTexelLobe(glossy, lobes, lobeAlbedo, at, point, normal, eye, toLight, 0.5 * size / max(length(toPlace), 1e-6)) * strength;
    }
    return total / float(count);
}
#endif

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec3 normal = texelFetch(normals, at, 0).xyz;
    vec3 point = texelFetch(points, at, 0).xyz;
    vec3 lightVector = srbfLightVector(pointLight.position, pointLight.positionLow, point);
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
    if (profiled) {
        visibility *= srbfProfile(profile, sphere.w > 0.0 ? point - sphere.xyz : fromLight, pointLight.axis, profileAcross, profileUp, profileTangent);
    }
    response = vec4(srbfDirect(normal, toLight, visibility) * strength * weight, 1.0);
#ifdef SRBF_LOBES
    if (max(visibility.r, max(visibility.g, visibility.b)) > 0.0 && texelFetch(lobes, at, 0).b > 0.0) {
        response.rgb += reflected(at, point, normal, lightVector) * visibility * weight;
    }
#endif
}
