// SPDX-License-Identifier: MIT
/* srbfElu: four numbers through the activation of a neural decoder: x above 0, exp(x) - 1 below.
   use:    vec4 srbfElu(vec4 x)
   domain: any; result above -1
   twin:   srbf.basis.neural_decoder.elu
   cite:   Dulecha2020 */
vec4 srbfElu(vec4 x) {
    vec4 zero = vec4(0.0);
    return max(x, zero) + (exp(min(x, zero)) - 1.0);
}
