// SPDX-License-Identifier: MIT
/* srbfDiscFactor: the share of a receiver's light that comes from a small surface, taken as a disc: cos cos A / (pi d^2 + A), nothing between.
   use:    float srbfDiscFactor(vec3 toward, vec3 normal, vec3 facing, float area)
   domain: toward: from the receiver to the surface, m; unit normals of the receiver and of the surface; square meters
   twin:   srbf.visibility.near_sources.disc_factors
   cite:   - */
float srbfDiscFactor(vec3 toward, vec3 normal, vec3 facing, float area) {
    float squared = max(dot(toward, toward), 1e-12);
    return max(dot(toward, normal), 0.0) * max(-dot(toward, facing), 0.0) * area / (squared * (3.14159265 * squared + area));
}
