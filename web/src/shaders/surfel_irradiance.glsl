// SPDX-License-Identifier: MIT
// What one look of a light lays on each cell of a scene's surfaces, added to that of the looks before: the arithmetic of srbf/visibility/received.py.
// SRBF_PROFILE: the light has a profile. SRBF_CHOSEN: it shines on some cells alone. SRBF_DISTANT: a directional light. SRBF_SHADOW: 0 none, 1 a map of the asset's own triangles, 2 an engine's map that compares, 3 one that holds
// depths (or their means, VSM). SRBF_MEAN_NORMALS: normals may be means over several faces. SRBF_REVERSED: the engine's depth is 1 where it is nearest.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp samplerCube;
precision highp sampler2DShadow;
precision highp samplerCubeShadow;

#include "surfels/cell_irradiance.glsl"
#include "surfels/cell_on_cube.glsl"
#include "surfels/cell_on_map.glsl"
#ifdef SRBF_MEAN_NORMALS
#include "cube_visibility.glsl"
#endif
#ifdef SRBF_PROFILE
#include "surfels/profiled_irradiance.glsl"
#endif

uniform sampler2D places;   // less the middle of all cells, meters; area
uniform sampler2D normals;  // unit; share of the patch's area
uniform sampler2D former;
uniform float lift;         // meters: of a cell above its surface, where its shadow is looked up
uniform vec3 light;         // place, less that middle, or the unit direction to it
uniform vec3 color;
uniform vec3 axis;
uniform float a0;
uniform float radius;
uniform int falloff;
uniform float versineInner;
uniform float versineOuter;
uniform float lambertian;
#ifdef SRBF_PROFILE
uniform sampler2D profile;
uniform vec3 profileAcross;
uniform vec3 profileUp;
uniform float profileTangent;
#endif
#ifdef SRBF_CHOSEN
uniform sampler2D chosen;    // 1 on the cells that it shines on, else 0
#endif
#if SRBF_SHADOW == 1
uniform sampler2D nearness;  // six faces of a cube, or one map of a directional light
uniform float reach;         // meters of half a directional map's side
uniform vec3 across;
uniform vec3 up;
#elif SRBF_SHADOW > 1
uniform mat4 sceneFromCell;
uniform mat4 shadowMatrix;
uniform float shadowBias;
uniform float shadowNormalBias;
uniform float shadowIntensity;
#ifdef SRBF_CUBE
uniform vec2 shadowDepths;  // near, far, meters
#if SRBF_SHADOW == 2
uniform samplerCubeShadow shadowMap;
#else
uniform samplerCube shadowMap;
#endif
#elif SRBF_SHADOW == 2
uniform sampler2DShadow shadowMap;
#else
uniform sampler2D shadowMap;
#endif
#endif

out vec4 irradiance;

vec3 unshadowed(vec4 cell, vec3 normal) {
#ifdef SRBF_DISTANT
    return color * max(dot(normal, light), 0.0);
#else
    SrbfPointLight pointLight = SrbfPointLight(light, vec3(0.0), color, axis, a0, radius, versineInner, versineOuter, falloff);
#ifdef SRBF_PROFILE
    return color * srbfProfiledIrradiance(cell, normal, pointLight, profile, profileAcross, profileUp, profileTangent);
#else
    return color * srbfCellIrradiance(cell, normal, pointLight, lambertian);
#endif
#endif
}

#if SRBF_SHADOW == 1 && defined(SRBF_MEAN_NORMALS)
// The nearest surfaces about a lifted cell, whose plane is not known.
float visibility(vec3 place, vec3 normal) {
#ifdef SRBF_DISTANT
    vec2 at = vec2(dot(place, across), dot(place, up)) / reach * 0.5 + 0.5;
    return srbfSurfelVisibility(nearness, ivec2(0), textureSize(nearness, 0).x, vec3(at, dot(place, light) + 2.0 * reach));
#else
    return cubeVisibility(nearness, place - light);
#endif
}
#elif SRBF_SHADOW == 1
// The nearest surface at the texel that a lifted cell falls on, against the cell's plane at the texel's middle.
float visibility(vec3 place, vec3 normal) {
    ivec2 size = textureSize(nearness, 0);
#ifdef SRBF_DISTANT
    ivec2 texel;
    float height = srbfCellOnMap(place, normal, light, across, up, reach, size.x, texel);
    return texelFetch(nearness, texel, 0).r > height ? 0.0 : 1.0;
#else
    int width = size.y / 2;
    ivec3 texel;
    float own = srbfCellOnCube(place - light, normal, width, texel);
    return texelFetch(nearness, ivec2(texel.z % 3, texel.z / 3) * width + texel.xy, 0).r > own ? 0.0 : 1.0;
#endif
}
#elif SRBF_SHADOW > 1
// As three.js' own materials look it up, without their blur.
float visibility(vec3 place, vec3 normal) {
    vec3 facing = normalize(mat3(sceneFromCell) * normal);
    vec4 at = shadowMatrix * vec4((sceneFromCell * vec4(place, 1.0)).xyz + facing * shadowNormalBias, 1.0);
#ifdef SRBF_CUBE
    vec3 size = abs(at.xyz);
    float z = max(max(size.x, size.y), size.z);
    if (z < shadowDepths.x || z > shadowDepths.y) {
        return 1.0;
    }
    float depth = shadowDepths.y * (z - shadowDepths.x) / (z * (shadowDepths.y - shadowDepths.x));
#ifdef SRBF_REVERSED
    depth = 1.0 - depth - shadowBias;
#else
    depth += shadowBias;
#endif
    vec3 coordinates = at.xyz;
#else
    vec3 coordinates = at.xyz / at.w;
#ifdef SRBF_REVERSED
    float depth = coordinates.z - shadowBias;
#else
    float depth = coordinates.z + shadowBias;
#endif
    if (at.w <= 0.0 || any(lessThan(coordinates.xy, vec2(0.0))) || any(greaterThan(coordinates.xy, vec2(1.0))) || depth > 1.0) {
        return 1.0;
    }
#endif
#if SRBF_SHADOW == 2
#ifdef SRBF_CUBE
    float lit = texture(shadowMap, vec4(coordinates, depth));
#else
    float lit = texture(shadowMap, vec3(coordinates.xy, depth));
#endif
#else
#ifdef SRBF_CUBE
    float stored = texture(shadowMap, coordinates).r;
#else
    float stored = texture(shadowMap, coordinates.xy).r;
#endif
#ifdef SRBF_REVERSED
    float lit = step(stored, depth);
#else
    float lit = step(depth, stored);
#endif
#endif
    return mix(1.0, lit, shadowIntensity);
}
#else
float visibility(vec3 place, vec3 normal) {
    return 1.0;
}
#endif

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 cell = texelFetch(places, at, 0);
    vec3 normal = texelFetch(normals, at, 0).xyz;
    vec3 amount = unshadowed(cell, normal);
#ifdef SRBF_CHOSEN
    amount *= texelFetch(chosen, at, 0).r;
#endif
    if (amount != vec3(0.0)) {
        amount *= visibility(cell.xyz + lift * normal, normal);
    }
    irradiance = vec4(texelFetch(former, at, 0).rgb + amount, 1.0);
}
