// SPDX-License-Identifier: MIT
// A product of matrices of RGB numbers, and what is added to it: row i of a matrix is row i of its texture. SRBF_EXCHANGE: the exchange of light that changed
// albedo adds, of gather (left) and sent (right). SRBF_PLAIN: nothing is added.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "surfels/matrix_product.glsl"
#include "surfels/changed_exchange.glsl"

uniform sampler2D added;
uniform sampler2D left;
uniform sampler2D right;
uniform sampler2D albedo;  // of each surfel now, and of the bake
uniform int count;

out vec4 product;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
#ifdef SRBF_EXCHANGE
    vec3 total = srbfChangedExchange(left, right, albedo, count, at);
#else
    vec3 total = srbfMatrixProduct(left, right, count, at);
#endif
#ifndef SRBF_PLAIN
    total += texelFetch(added, at, 0).rgb;
#endif
    product = vec4(total, 1.0);
}
