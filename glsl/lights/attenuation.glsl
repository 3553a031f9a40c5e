// SPDX-License-Identifier: MIT
/* srbfAttenuation: a0/|L|, or its square, with |L| never less than the light's radius.
   use:    float srbfAttenuation(float dist, float a0, float radius, int falloff)
   domain: dist >= 0, a0 > 0 and radius > 0 in meters; falloff SRBF_FALLOFF_LINEAR or SRBF_FALLOFF_INVERSE_SQUARE
   twin:   srbf.light_geometry.attenuation
   cite:   Wong2005, fig. 10 */
#define SRBF_FALLOFF_LINEAR 0
#define SRBF_FALLOFF_INVERSE_SQUARE 1

float srbfAttenuation(float dist, float a0, float radius, int falloff) {
    float ratio = a0 / max(dist, radius);
    return falloff == SRBF_FALLOFF_INVERSE_SQUARE ? ratio * ratio : ratio;
}
