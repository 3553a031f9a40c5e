// SPDX-License-Identifier: MIT
/* srbfBlockSum: the parts that srbfTablePart leaves of a row, added up.
   use:    vec3 srbfBlockSum(highp sampler2D parts, int blocks, int row)
   domain: parts: row by row; 0 for a row past the last texel
   twin:   numpy.sum
   cite:   - */
vec3 srbfBlockSum(highp sampler2D parts, int blocks, int row) {
    ivec2 size = textureSize(parts, 0);
    vec3 total = vec3(0.0);
    for (int i = row * blocks; i < (row + 1) * blocks; ++i) {
        if (i < size.x * size.y) {
            total += texelFetch(parts, ivec2(i % size.x, i / size.x), 0).rgb;
        }
    }
    return total;
}
