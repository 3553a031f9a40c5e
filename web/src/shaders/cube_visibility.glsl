// SPDX-License-Identifier: MIT
// How much of a place is seen from another, 0 to 1, by a cube of maps about that place, three faces in each of two rows; the other one is just
// above a surface whose plane is not known.
#include "shadow/cube_face.glsl"
#include "shadow/point_shadow_place.glsl"
#include "surfels/surfel_visibility.glsl"

float cubeVisibility(highp sampler2D nearness, vec3 fromPlace) {
    int width = textureSize(nearness, 0).y / 2;
    int face = srbfCubeFace(fromPlace);
    int axis = face / 2;
    vec3 ahead = vec3(axis == 0, axis == 1, axis == 2);  // columns run along the axis after it, rows along the one after that
    vec3 seen = srbfPointShadowPlace(fromPlace, ahead.zxy, ahead.yzx, face % 2 == 0 ? ahead : -ahead, 1.0);
    return srbfSurfelVisibility(nearness, ivec2(face % 3, face / 3) * width, width, seen);
}
