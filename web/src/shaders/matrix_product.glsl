// SPDX-License-Identifier: MIT
// A product of matrices, RGB: row i of a matrix is row i of its texture. By default added + left right. SRBF_BETWEEN: `left` and `right` have one channel, and
// column k of `left` is taken times number k of a list. SRBF_COLUMNS: `right` has one channel, column j of the product is taken times number j, nothing is added.
// SRBF_PLAIN: nothing is added.
precision highp float;
precision highp int;
precision highp sampler2D;

uniform sampler2D added;
uniform sampler2D left;
uniform sampler2D right;
uniform sampler2D numbers;
uniform int count;

out vec4 product;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec3 total = vec3(0.0);
    for (int k = 0; k < count; ++k) {
        vec4 first = texelFetch(left, ivec2(k, at.y), 0);
        vec4 second = texelFetch(right, ivec2(at.x, k), 0);
#if defined(SRBF_BETWEEN)
        total += first.r * second.r * texelFetch(numbers, ivec2(k, 0), 0).rgb;
#elif defined(SRBF_COLUMNS)
        total += first.rgb * second.r;
#else
        total += first.rgb * second.rgb;
#endif
    }
#if defined(SRBF_COLUMNS)
    product = vec4(total * texelFetch(numbers, ivec2(at.x, 0), 0).rgb, 1.0);
#elif defined(SRBF_PLAIN)
    product = vec4(total, 1.0);
#else
    product = vec4(total + texelFetch(added, at, 0).rgb, 1.0);
#endif
}
