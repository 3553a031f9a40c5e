// SPDX-License-Identifier: MIT
/* srbfTablePart: a part of the sum over a table's row times a list of RGB numbers. Rows are split into `blocks` parts that follow each other,
   so that more of the GPU works on a short list of rows.
   use:    vec3 srbfTablePart(highp sampler2D table, highp sampler2D numbers, int rows, int count, int blocks, bool gray, int index)
   domain: table: row after row, `count` entries each, over as many texels as needed; gray: it has one channel; numbers: `count` of them, row by
           row; index: row * blocks + block, 0 past the last row
   twin:   numpy.matmul
   cite:   - */
vec3 srbfTablePart(highp sampler2D table, highp sampler2D numbers, int rows, int count, int blocks, bool gray, int index) {
    int row = index / blocks;
    int part = (count + blocks - 1) / blocks;
    int first = (index % blocks) * part;
    int end = row < rows ? min(first + part, count) : first;
    int tableWidth = textureSize(table, 0).x;
    int width = textureSize(numbers, 0).x;
    vec3 total = vec3(0.0);
    for (int i = first; i < end; ++i) {
        int at = row * count + i;
        vec3 entry = texelFetch(table, ivec2(at % tableWidth, at / tableWidth), 0).rgb;
        vec3 number = texelFetch(numbers, ivec2(i % width, i / width), 0).rgb;
        total += gray ? entry.r * number : entry * number;
    }
    return total;
}
