// SPDX-License-Identifier: MIT
/* srbfVersine: 1 - a.b of two unit vectors, precise where they nearly agree.
   use:    float srbfVersine(vec3 a, vec3 b)
   domain: a of length 1 or 0, b of length 1; result in [0, 2], 1 where a is zero
   twin:   numpy.dot
   cite:   |a - b|^2 = 2 - 2 a.b; 1.0 - dot(a, b) would lose all but a few digits near 0 */
float srbfVersine(vec3 a, vec3 b) {
    vec3 chord = a - b;
    return dot(a, a) > 0.5 ? 0.5 * dot(chord, chord) : 1.0;
}
