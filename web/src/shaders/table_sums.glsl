// SPDX-License-Identifier: MIT
// A table of rows times a list of RGB numbers. A row's sum is split into `blocks` parts that follow each other, so that more of the GPU works on a short
// list of rows; SRBF_GRAY: the table has one channel.
precision highp float;
precision highp int;
precision highp sampler2D;

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
    int row = index / blocks;
    int length_ = (count + blocks - 1) / blocks;
    int first = (index % blocks) * length_;
    int end = row < rows ? min(first + length_, count) : first;
    int tableWidth = textureSize(table, 0).x;
    int numbersWidth = textureSize(numbers, 0).x;
    vec3 total = vec3(0.0);
    for (int i = first; i < end; ++i) {
        int at = row * count + i;
        vec4 entry = texelFetch(table, ivec2(at % tableWidth, at / tableWidth), 0);
#ifdef SRBF_GRAY
        entry = entry.rrrr;
#endif
        total += entry.rgb * texelFetch(numbers, ivec2(i % numbersWidth, i / numbersWidth), 0).rgb;
    }
    sum = vec4(total * scale, 1.0);
}
