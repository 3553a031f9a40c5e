// SPDX-License-Identifier: MIT
/* srbfCellOnMap: the texel of a directional light's shadow map that a cell falls on, and the height of the cell's plane towards the light at
   the middle of that texel, plus twice the reach: the cell is lit unless the texel holds more.
   use:    float srbfCellOnMap(vec3 place, vec3 normal, vec3 toLight, vec3 across, vec3 up, float reach, int width, out ivec2 texel)
   domain: place: of the cell, a little above its surface, less the middle of the map, m; unit normal, towards the light; toLight, across (of
           columns) and up (of rows): an orthonormal frame; reach: half a side of the map, m; width: texels of a side
   twin:   numpy.dot
   cite:   - */
float srbfCellOnMap(vec3 place, vec3 normal, vec3 toLight, vec3 across, vec3 up, float reach, int width, out ivec2 texel) {
    const float TILT = 0.25;  // m, at most, between the cell and its plane at the texel's middle
    vec2 flat_ = vec2(dot(place, across), dot(place, up));
    texel = clamp(ivec2((flat_ / reach * 0.5 + 0.5) * float(width)), ivec2(0), ivec2(width - 1));
    vec2 middle = ((vec2(texel) + 0.5) / float(width) * 2.0 - 1.0) * reach;
    float own = dot(place, toLight);
    float plane = (dot(normal, place) - dot(vec2(dot(normal, across), dot(normal, up)), middle)) / dot(normal, toLight);
    return clamp(plane, own - TILT, own + TILT) + 2.0 * reach;
}
