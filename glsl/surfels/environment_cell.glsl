// SPDX-License-Identifier: MIT
/* srbfEnvironmentCell: the mean radiance of an equirectangular map in one cell of the octahedral map of directions, by solid angle.
   use:    vec3 srbfEnvironmentCell(highp sampler2D panorama, vec3 ahead, vec3 left, vec3 up, int cell, int side)
   domain: ahead (where the middle of the map is), left, up (where its first row is): an orthonormal frame, in the asset's; cell: row * side
           + column, rows along v; side: cells per side. At least 8 x 8 texels of the map are read, at most 128 x 128
   twin:   srbf.visibility.environment_cells.cell_radiance
   cite:   Cigolle2014 */
vec3 srbfEnvironmentCell(highp sampler2D panorama, vec3 ahead, vec3 left, vec3 up, int cell, int side) {
    const float PI = 3.141592653589793;
    ivec2 size = textureSize(panorama, 0);
    int steps = clamp(size.y / side, 8, 128);
    vec2 corner = vec2(float(cell % side), float(cell / side));
    vec3 total = vec3(0.0);
    float whole = 0.0;
    for (int i = 0; i < steps * steps; ++i) {
        vec2 part = (vec2(float(i % steps), float(i / steps)) + 0.5) / float(steps);
        vec2 place = (corner + part) / float(side) * 2.0 - 1.0;
        vec2 folded = vec2(place.x < 0.0 ? -1.0 : 1.0, place.y < 0.0 ? -1.0 : 1.0) * (1.0 - abs(place.yx));
        float height = 1.0 - abs(place.x) - abs(place.y);
        vec3 along = vec3(height < 0.0 ? folded : place, height);
        float inverse = inversesqrt(dot(along, along));
        vec3 direction = along * inverse;
        float u = 0.5 - atan(dot(direction, left), dot(direction, ahead)) / (2.0 * PI);
        float v = acos(clamp(dot(direction, up), -1.0, 1.0)) / PI;
        float weight = inverse * inverse * inverse;  // solid angle per area of the octahedral map
        total += weight * texelFetch(panorama, clamp(ivec2(vec2(u, v) * vec2(size)), ivec2(0), size - 1), 0).rgb;
        whole += weight;
    }
    return total / whole;
}
