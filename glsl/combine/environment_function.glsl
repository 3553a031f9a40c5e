// SPDX-License-Identifier: MIT
/* srbfCombineEnvironmentFunction: an environment's weight of one light function, from its weights of the Gaussians of the light basis.
   use:    vec3 srbfCombineEnvironmentFunction(sampler2D gaussians, sampler2D coefficients, int index)
   domain: gaussians: RGBA32F, one row: the B centers of the light basis at its first spread, then at its second, and so on; coefficients:
           RGBA32F, B wide, one row per function: light_coefficients.exr, and in alpha which spread the function has, counted from 0
   twin:   srbf.methods.projected_weights
   cite:   - */
vec3 srbfCombineEnvironmentFunction(highp sampler2D gaussians, highp sampler2D coefficients, int index) {
    int centers = textureSize(coefficients, 0).x;
    int first = int(texelFetch(coefficients, ivec2(0, index), 0).a + 0.5) * centers;
    vec3 sum = vec3(0.0);
    for (int b = 0; b < centers; ++b) {
        sum += texelFetch(coefficients, ivec2(b, index), 0).rgb * texelFetch(gaussians, ivec2(first + b, 0), 0).rgb;
    }
    return sum;
}
