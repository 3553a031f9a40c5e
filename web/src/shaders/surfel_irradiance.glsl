// SPDX-License-Identifier: MIT
// What one look of a light lays on each cell of a scene's surfaces, added to that of the looks before: the arithmetic of srbf/visibility/received.py.
// SRBF_DISTANT: a directional light. SRBF_SHADOW: 0 none, 1 a map of the asset's own triangles, 2 an engine's map that compares, 3 one that holds
// depths (or their means, VSM). SRBF_REVERSED: the engine's depth is 1 where it is nearest.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp samplerCube;
precision highp sampler2DShadow;
precision highp samplerCubeShadow;

#include "lights/attenuation.glsl"
#include "lights/spot_cone.glsl"
#include "lights/versine.glsl"
#include "shadow/cube_face.glsl"

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
#if SRBF_SHADOW == 1
uniform sampler2D nearness;  // six faces of a cube, or one map of a directional light
uniform float reach;         // tangent of a face's half-angle; meters of half a directional map's side
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

const float NEAR = 8.0;  // sides of a cell, closer than which it is measured by PARTS x PARTS points
const int PARTS = 4;
const float TILT = 0.25; // of the nearness of a cell: how much the depth of its plane may vary within one texel of a shadow map
const float SLACK = 1e-4;

float falling(vec3 lightVector, vec3 normal, float least) {
    float dist = length(lightVector);
    vec3 toLight = lightVector / max(dist, 1e-15);
    float cosine = dot(toLight, normal);
    if (cosine <= 0.0) {
        return 0.0;
    }
    float cone = srbfSpotCone(srbfVersine(-toLight, axis), versineInner, versineOuter);
    float shining = mix(1.0, max(dot(-toLight, axis), 0.0), lambertian);
    return cosine * cone * shining * srbfAttenuation(dist, a0, max(radius, sqrt(least)), falloff);
}

// [Duff2017]
void frame(vec3 n, out vec3 tangent, out vec3 bitangent) {
    float side = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (side + n.z);
    float b = n.x * n.y * a;
    tangent = vec3(1.0 + side * n.x * n.x * a, side * b, -side * n.x);
    bitangent = vec3(b, side + n.y * n.y * a, -n.y);
}

float unshadowed(vec4 cell, vec3 normal) {
#ifdef SRBF_DISTANT
    return max(dot(normal, light), 0.0);
#else
    vec3 lightVector = light - cell.xyz;
    float least = cell.w / 6.283185307179586;
    if (dot(lightVector, lightVector) >= NEAR * NEAR * cell.w) {
        return falling(lightVector, normal, least);
    }
    vec3 tangent;
    vec3 bitangent;
    frame(normal, tangent, bitangent);
    float total = 0.0;
    for (int part = 0; part < PARTS * PARTS; ++part) {
        vec2 at = sqrt(cell.w) * ((vec2(part / PARTS, part % PARTS) + 0.5) / float(PARTS) - 0.5);
        total += falling(lightVector - at.x * tangent - at.y * bitangent, normal, least / float(PARTS * PARTS));
    }
    return total / float(PARTS * PARTS);
#endif
}

#if SRBF_SHADOW == 1
// The nearest surface at the texel that a lifted cell falls on, against the cell's plane at the texel's middle.
float visibility(vec3 place, vec3 normal) {
    ivec2 size = textureSize(nearness, 0);
#ifdef SRBF_DISTANT
    vec2 flat_ = vec2(dot(place, across), dot(place, up));
    ivec2 texel = clamp(ivec2((flat_ / reach * 0.5 + 0.5) * vec2(size)), ivec2(0), size - 1);
    vec2 middle = ((vec2(texel) + 0.5) / vec2(size) * 2.0 - 1.0) * reach;
    float own = dot(place, light);
    float plane = (dot(normal, place) - dot(vec2(dot(normal, across), dot(normal, up)), middle)) / dot(normal, light);
    plane = clamp(plane, own - TILT, own + TILT);
    return texelFetch(nearness, texel, 0).r > plane + 2.0 * reach ? 0.0 : 1.0;
#else
    vec3 fromLight = place - light;
    int face = srbfCubeFace(fromLight);
    int k = face / 2;
    float side = face % 2 == 0 ? 1.0 : -1.0;
    vec3 turned = k == 0 ? fromLight.yzx : k == 1 ? fromLight.zxy : fromLight;
    vec3 plane = k == 0 ? normal.yzx : k == 1 ? normal.zxy : normal;
    float depth = turned.z * side;
    int width = size.y / 2;
    ivec2 texel = clamp(ivec2((turned.xy / (depth * reach) * 0.5 + 0.5) * float(width)), ivec2(0), ivec2(width - 1));
    vec2 tangents = ((vec2(texel) + 0.5) / float(width) * 2.0 - 1.0) * reach;
    float own = dot(plane, vec3(tangents, side)) / dot(normal, fromLight);
    own = clamp(own, (1.0 - TILT) / depth, (1.0 + TILT) / depth);
    return texelFetch(nearness, ivec2(face % 3, face / 3) * width + texel, 0).r > own * (1.0 + SLACK) ? 0.0 : 1.0;
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
    float amount = unshadowed(cell, normal);
    if (amount > 0.0) {
        amount *= visibility(cell.xyz + lift * normal, normal);
    }
    irradiance = vec4(texelFetch(former, at, 0).rgb + color * amount, 1.0);
}
