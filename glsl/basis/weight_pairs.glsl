// SPDX-License-Identifier: MIT
/* srbfWeightPairs: R_i for one light direction from a table of values and differences: one fetch where srbfWeight takes two.
   use:    float srbfWeightPairs(sampler2D pairs, float versine)
   domain: versine = 1 - cos theta in [0, 2]; pairs n x 1 texels, RG32F: R at versine 2 j / (n - 1), which is the R
           table from its end, and the difference to the next entry, 0 in the last; result in [0, 1]; SRBF_SAMPLED reads
           the same texel by a nearest sampler, which is faster in software renderers, since they check a fetch's bounds
   twin:   srbf.basis.gaussian.lookup
   cite:   Wong2005, fig. 9 */
float srbfWeightPairs(highp sampler2D pairs, float versine) {
    // Never the hardware's filter: its fractions have 8 bits. Counted from the center, where R is most sensitive to the versine.
    int n = textureSize(pairs, 0).x;
    float place = versine * (0.5 * float(n - 1));
    float entry = floor(place);
#ifdef SRBF_SAMPLED
    vec2 pair = textureLod(pairs, vec2((entry + 0.5) / float(n), 0.5), 0.0).rg;
#else
    vec2 pair = texelFetch(pairs, ivec2(int(entry), 0), 0).rg;
#endif
    return pair.x + pair.y * (place - entry);
}
