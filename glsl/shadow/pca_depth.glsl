// SPDX-License-Identifier: MIT
/* srbfPcaDepth: how far a point sees in one direction of its map, from principal components, m.
   use:    float srbfPcaDepth(highp sampler2D coefficients, highp sampler2D bases, int point, int cluster, int groups, int texel)
   domain: groups: vec4s per point, (coefficients + 1) / 4 rounded up, the first number 1; coefficients: of all points one after the other,
           in rows; bases: row `cluster * groups + group`, column `texel`; both as srbf.visibility.pca_textures has them
   twin:   srbf.visibility.pca_visibility.PcaVisibility.depths
   cite:   Nowrouzezahrai2007 */
float srbfPcaDepth(highp sampler2D coefficients, highp sampler2D bases, int point, int cluster, int groups, int texel) {
    int width = textureSize(coefficients, 0).x;
    float depth = 0.0;
    for (int group = 0; group < groups; ++group) {
        int at = point * groups + group;
        vec4 own = texelFetch(coefficients, ivec2(at % width, at / width), 0);
        depth += dot(own, texelFetch(bases, ivec2(texel, cluster * groups + group), 0));
    }
    return depth;
}
