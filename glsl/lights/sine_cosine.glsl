// SPDX-License-Identifier: MIT
/* srbfSineCosine: (sine, cosine) of a fraction of a right angle, equally precise on every GPU: GLSL allows an error of 2^-11.
   use:    vec2 srbfSineCosine(int part, int whole)
   domain: whole > 0; the angle is part / whole right angles, |part| below 2^30 and |part / whole| below 2^20; error below 3e-7
   twin:   numpy.sin
   cite:   Taylor series on [-pi/4, pi/4]: the remainder is below 3e-8 of the cosine, 2e-9 of the sine */
vec2 srbfSineCosine(int part, int whole) {
    int quarter = int(floor(float(part) / float(whole) + 0.5));
    float x = 1.57079632679490 * (float(part - quarter * whole) / float(whole));
    float x2 = x * x;
    float sine = x + x * x2 * (-1.0 / 6.0 + x2 * (1.0 / 120.0 + x2 * (-1.0 / 5040.0 + x2 * (1.0 / 362880.0))));
    float cosine = 1.0 + x2 * (-0.5 + x2 * (1.0 / 24.0 + x2 * (-1.0 / 720.0 + x2 * (1.0 / 40320.0))));
    vec2 turned = (quarter & 1) == 0 ? vec2(sine, cosine) : vec2(cosine, -sine);
    return (quarter & 2) == 0 ? turned : -turned;
}
