// SPDX-License-Identifier: MIT
/* srbfPatchMean: the mean irradiance of a patch, by area, over its cells, which follow each other.
   use:    vec3 srbfPatchMean(highp sampler2D irradiance, highp sampler2D normals, highp sampler2D ranges, ivec2 at)
   domain: irradiance: of every cell, row by row; normals: the cell's share of its patch's area in the last channel; ranges: of every patch,
           its first cell and how many there are
   twin:   srbf.visibility.received.patch_means
   cite:   - */
vec3 srbfPatchMean(highp sampler2D irradiance, highp sampler2D normals, highp sampler2D ranges, ivec2 at) {
    ivec2 range = ivec2(texelFetch(ranges, at, 0).xy + 0.5);
    int width = textureSize(irradiance, 0).x;
    vec3 total = vec3(0.0);
    for (int i = range.x; i < range.x + range.y; ++i) {
        ivec2 cell = ivec2(i % width, i / width);
        total += texelFetch(normals, cell, 0).w * texelFetch(irradiance, cell, 0).rgb;
    }
    return total;
}
