// SPDX-License-Identifier: MIT
/* srbfClusterIndex: the cluster of one texel.
   use:    int srbfClusterIndex(sampler2D clusters, ivec2 texel)
   domain: clusters an R8 texture of cluster_index.png, linear and unfiltered; result in [0, 255]
   twin:   srbf.methods.coefficient_maps.first_function
   cite:   Sloan2003 */
int srbfClusterIndex(highp sampler2D clusters, ivec2 texel) {
    return int(texelFetch(clusters, texel, 0).r * 255.0 + 0.5);
}
