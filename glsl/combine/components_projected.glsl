// SPDX-License-Identifier: MIT
/* srbfCombineComponentsProjected: an offset plus the sum over components of projected weight times stored value; the weights include the
   decoding.
   use:    vec3 srbfCombineComponentsProjected(sampler2DArray planes, vec2 uv, float level, int firstLayer, vec4 weights[3 * SRBF_LAYERS],
                                        vec3 offset)
   domain: weights: three vec4 per layer, the red, green and blue weights of its four components, each w_j times the channel's scale;
           offset: w_0 plus the sum of w_j times bias, with one pass only; level: mip level, 0 without mip maps; result signed, before the
           clamp
   twin:   srbf.methods.linear_response
   cite:   Sloan2003 */
#ifndef SRBF_COMPONENTS
#error define SRBF_COMPONENTS: components per texel
#endif
#ifndef SRBF_LAYERS
#define SRBF_LAYERS ((SRBF_COMPONENTS + 3) / 4)
#endif

vec3 srbfCombineComponentsProjected(highp sampler2DArray planes, vec2 uv, float level, int firstLayer, vec4 weights[3 * SRBF_LAYERS],
                             vec3 offset) {
    vec3 sum = offset;
    for (int i = 0; i < SRBF_LAYERS; ++i) {
        vec4 stored = textureLod(planes, vec3(uv, float(firstLayer + i)), level);
        sum += vec3(dot(stored, weights[3 * i]), dot(stored, weights[3 * i + 1]), dot(stored, weights[3 * i + 2]));
    }
    return sum;
}
