// SPDX-License-Identifier: MIT
/* srbfWeight: R_i for one light direction, read from the 1D table by fetch and mix.
   use:    float srbfWeight(sampler2D rTable, float cosTheta)
   domain: rTable n x 1 texels in red, n >= 2, entry j at cosTheta = -1 + 2 j / (n - 1); cosTheta is clipped to [-1, 1];
           result in [0, 1]
   twin:   srbf.basis.gaussian.lookup
   cite:   Wong2005, fig. 9 */
float srbfWeight(highp sampler2D rTable, float cosTheta) {
    // Never the hardware's filter: its fractions have 8 bits. The position is counted from the middle of the table, where cosTheta
    // is 0, so that the fraction keeps the precision of cosTheta itself.
    int n = textureSize(rTable, 0).x;
    float middle = 0.5 * float(n - 1);
    float fromMiddle = clamp(cosTheta, -1.0, 1.0) * middle;
    int j = clamp(int(fromMiddle + middle), 0, n - 2);
    float fraction = fromMiddle - (float(j) - middle);
    float lower = texelFetch(rTable, ivec2(j, 0), 0).r;
    float upper = texelFetch(rTable, ivec2(j + 1, 0), 0).r;
    return lower + (upper - lower) * fraction;
}
