// SPDX-License-Identifier: MIT
/* srbfNeighborLight: the irradiance of a pixel of a deep framebuffer: the mean of the light of its view clusters by their weights.
   use:    vec3 srbfNeighborLight(highp sampler2DArray neighbors, int first, int layers, highp sampler2D light, ivec2 texel)
   domain: neighbors: 8 bits, nearest, low and high byte of a cluster, its weight, in so many layers from `first` on; light: irradiance
           cluster by cluster, the next row after the last column; times albedo / pi it is radiance
   twin:   srbf.methods.deep_framebuffer.DeepFramebuffer.weighted
   cite:   Hasan2005 */
vec3 srbfNeighborLight(highp sampler2DArray neighbors, int first, int layers, highp sampler2D light, ivec2 texel) {
    int width = textureSize(light, 0).x;
    vec2 uv = (vec2(texel) + 0.5) / vec2(textureSize(neighbors, 0).xy);
    vec3 total = vec3(0.0);
    float share = 0.0;
    for (int layer = first; layer < first + layers; ++layer) {
        ivec3 own = ivec3(textureLod(neighbors, vec3(uv, float(layer)), 0.0).rgb * 255.0 + 0.5);
        int cluster = own.r + 256 * own.g;
        total += float(own.b) * texelFetch(light, ivec2(cluster % width, cluster / width), 0).rgb;
        share += float(own.b);
    }
    return total / max(share, 1.0);
}
