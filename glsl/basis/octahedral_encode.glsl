// SPDX-License-Identifier: MIT
/* srbfOctahedralEncode: a direction's place on the octahedral square: z > 0 inside the diamond |u| + |v| < 1, the rest folded out.
   use:    vec2 srbfOctahedralEncode(vec3 direction)
   domain: any length but 0, up to 1e18; result in [-1, 1]; the zero vector goes to (0, 0), where +z is
   twin:   srbf.sphere.octahedral_encode
   cite:   Cigolle2014 */
vec2 srbfOctahedralEncode(vec3 direction) {
    vec3 d = direction / max(abs(direction.x) + abs(direction.y) + abs(direction.z), 1e-30);
    vec2 side = vec2(d.x < 0.0 ? -1.0 : 1.0, d.y < 0.0 ? -1.0 : 1.0);  // sign() would be 0 on the folds
    return d.z < 0.0 ? (1.0 - abs(d.yx)) * side : d.xy;
}
