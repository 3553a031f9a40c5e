// SPDX-License-Identifier: MIT
/* srbfCellOnCube: the texel of a shadow cube that a cell falls on, and the nearness, one over the depth, of the cell's plane at the middle of
   that texel: the cell is lit unless the texel holds more.
   use:    float srbfCellOnCube(vec3 fromLight, vec3 normal, int width, out ivec3 texel)
   domain: fromLight: the cell, a little above its surface, less the light, m; unit normal, towards the light; width: texels of a face; texel:
           column, row, face by srbfCubeFace; columns of a face run along the axis after its own, rows along the one after that
   twin:   numpy.dot
   cite:   - */
#include "shadow/cube_face.glsl"

float srbfCellOnCube(vec3 fromLight, vec3 normal, int width, out ivec3 texel) {
    const float TILT = 0.25;   // how much the depth of the plane may vary within a texel
    const float SLACK = 1e-4;  // of rounding
    int face = srbfCubeFace(fromLight);
    float side = face % 2 == 0 ? 1.0 : -1.0;
    vec3 turned = fromLight;
    vec3 plane = normal;
    if (face < 2) {
        turned = fromLight.yzx;
        plane = normal.yzx;
    } else if (face < 4) {
        turned = fromLight.zxy;
        plane = normal.zxy;
    }
    float depth = turned.z * side;
    vec2 place = (turned.xy / depth * 0.5 + 0.5) * float(width);
    ivec2 at = clamp(ivec2(place), ivec2(0), ivec2(width - 1));
    vec2 middle = (vec2(at) + 0.5) / float(width) * 2.0 - 1.0;
    float own = dot(plane, vec3(middle, side)) / dot(normal, fromLight);
    texel = ivec3(at, face);
    return clamp(own, (1.0 - TILT) / depth, (1.0 + TILT) / depth) * (1.0 + SLACK);
}
