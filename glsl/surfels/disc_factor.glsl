// SPDX-License-Identifier: MIT
/* srbfDiscFactor: the share of a receiver's light that comes from a small surface, nothing between: cos cos A / (pi d^2 + A), as of a disc;
   of one closer than 8 of its sides, as of a square of 4 x 4 discs.
   use:    float srbfDiscFactor(vec3 toward, vec3 normal, vec3 facing, float area)
   domain: toward: from the receiver to the surface, m; unit normals of the receiver and of the surface; square meters
   twin:   srbf.visibility.near_sources.disc_factors
   cite:   - */
#include "surfels/tangents.glsl"

float srbfDiscFactor(vec3 toward, vec3 normal, vec3 facing, float area) {
    const float CLOSE = 8.0;
    const int PARTS = 4;
    float far = -dot(toward, facing);
    int parts = far > 0.0 && dot(toward, toward) < CLOSE * CLOSE * area ? PARTS : 1;
    vec3 tangent;
    vec3 bitangent;
    srbfTangents(facing, tangent, bitangent);
    float part = area / float(parts * parts);
    float total = 0.0;
    for (int i = 0; i < parts * parts; ++i) {
        vec2 at = sqrt(area) * ((vec2(float(i / parts), float(i % parts)) + 0.5) / float(parts) - 0.5);
        vec3 there = toward + at.x * tangent + at.y * bitangent;
        float squared = max(dot(there, there), 1e-12);
        total += max(dot(there, normal), 0.0) * part / (squared * (3.14159265 * squared + part));
    }
    return total * max(far, 0.0);
}
