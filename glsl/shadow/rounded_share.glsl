// SPDX-License-Identifier: MIT
/* srbfRoundedShare: how far the lookup of a smooth surface moves from its triangle to the rounded surface, where light grazes it.
   use:    float srbfRoundedShare(float NoL, float NgL)
   domain: cosines of the light to the shading normal and to the triangle's; result in [0, 1]
   twin:   srbf.visibility.shadow.rounded_share
   cite:   Hanika2021 */
float srbfRoundedShare(float NoL, float NgL) {
    const float TERMINATOR = 0.1;  // cosine below which it moves, Cycles' default
    return clamp(NoL < TERMINATOR ? 2.0 - (NgL + NoL) / TERMINATOR : 1.0 - NgL / TERMINATOR, 0.0, 1.0);
}
