// SPDX-License-Identifier: MIT
/* srbfMatrixProduct: one entry of a product of matrices of RGB numbers; row i of a matrix is row i of its texture.
   use:    vec3 srbfMatrixProduct(highp sampler2D left, highp sampler2D right, int count, ivec2 at)
   domain: count: columns of `left`, rows of `right`; at: column and row of the product
   twin:   numpy.matmul
   cite:   - */
vec3 srbfMatrixProduct(highp sampler2D left, highp sampler2D right, int count, ivec2 at) {
    vec3 total = vec3(0.0);
    for (int k = 0; k < count; ++k) {
        total += texelFetch(left, ivec2(k, at.y), 0).rgb * texelFetch(right, ivec2(at.x, k), 0).rgb;
    }
    return total;
}
