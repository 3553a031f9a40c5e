// SPDX-License-Identifier: MIT
// A table of rows times a list of RGB numbers. A row's sum is split into `blocks` parts that follow each other, so that more of the GPU works on a short
// list of rows; SRBF_GRAY: the table has one channel.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "surfels/table_part.glsl"

uniform sampler2D table;   // row after row, over as many texels as needed
uniform float scale;
uniform sampler2D numbers;
uniform int count;         // columns
uniform int rows;
uniform int blocks;
uniform int width;         // of the target

out vec4 sum;

void main() {
    int index = int(gl_FragCoord.y) * width + int(gl_FragCoord.x);
#ifdef SRBF_GRAY
    const bool gray = true;
#else
    const bool gray = false;
#endif
    sum = vec4(srbfTablePart(table, numbers, rows, count, blocks, gray, index) * scale, 1.0);
}
