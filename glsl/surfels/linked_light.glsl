// SPDX-License-Identifier: MIT
/* srbfLinkedLight: the light that a row of sparse links brings: the sum over its links of rays times the light of the surfel, over all its rays.
   use:    vec3 srbfLinkedLight(highp sampler2D links, highp sampler2D rows, highp sampler2D light, int row, float rays)
   domain: links: 8 bits, low and high byte of the surfel, count of rays; rows: column and row in `links` of each row's first link, and how
           many follow each other; light: surfel by surfel, the next row after the last column
   twin:   srbf.visibility.sparse_links.SparseLinks.matrix
   cite:   Hasan2005 */
vec3 srbfLinkedLight(highp sampler2D links, highp sampler2D rows, highp sampler2D light, int row, float rays) {
    int across = textureSize(rows, 0).x;
    int columns = textureSize(links, 0).x;
    int width = textureSize(light, 0).x;
    ivec3 own = ivec3(texelFetch(rows, ivec2(row % across, row / across), 0).xyz + 0.5);
    ivec2 at = own.xy;
    vec3 total = vec3(0.0);
    for (int i = 0; i < own.z; ++i) {
        ivec3 link = ivec3(texelFetch(links, at, 0).rgb * 255.0 + 0.5);
        int surfel = link.r + 256 * link.g;
        total += float(link.b) * texelFetch(light, ivec2(surfel % width, surfel / width), 0).rgb;
        at = at.x + 1 < columns ? ivec2(at.x + 1, at.y) : ivec2(0, at.y + 1);
    }
    return total / rays;
}
