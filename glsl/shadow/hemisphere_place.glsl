// SPDX-License-Identifier: MIT
/* srbfHemispherePlace: where a direction falls on the square map of the hemisphere above a point, 0 to 1.
   use:    vec2 srbfHemispherePlace(vec3 toLight, vec3 normal)
   domain: unit vectors; equal areas of the map are equal solid angles; what is below the horizon falls on the border
   twin:   srbf.visibility.hemisphere_map.place_of
   cite:   Shirley1997 */
vec2 srbfHemispherePlace(vec3 toLight, vec3 normal) {
    const float STEPS = 4096.0;  // so that rounding errors do not turn the frame of a wall
    vec3 n = floor(normal * STEPS + 0.5) / STEPS;
    float side = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (side + n.z);
    float b = n.x * n.y * a;
    vec3 tangent = vec3(1.0 + side * n.x * n.x * a, side * b, -side * n.x);  // Duff2017
    vec3 bitangent = vec3(b, side + n.y * n.y * a, -n.y);
    vec2 disc = vec2(dot(toLight, tangent), dot(toLight, bitangent)) / sqrt(1.0 + max(dot(toLight, n), 0.0));
    float radius = min(length(disc), 1.0);
    bool wide = abs(disc.x) > abs(disc.y);
    float leading = wide ? disc.x : disc.y;
    float turn = (wide ? disc.y : disc.x) / (leading == 0.0 ? 1.0 : leading);
    float along = leading < 0.0 ? -radius : radius;
    float across = along * atan(turn) * 1.2732395447351628;
    return 0.5 + 0.5 * (wide ? vec2(along, across) : vec2(across, along));
}
