// SPDX-License-Identifier: MIT
/* srbfWeightFormula: R_i for one light direction by formula, exp(-theta^2 / (2 spread^2)), without a table.
   use:    float srbfWeightFormula(float versine, float sharpness)
   domain: versine = 1 - cos theta in [0, 2], clipped to it; sharpness = 1 / (2 spread^2), spread in rad; result in [0, 1]
   twin:   srbf.basis.gaussian.weight
   cite:   Wong2005, eq. 2; Abramowitz1964, 4.4.46 */
float srbfWeightFormula(float versine, float sharpness) {
    // acos(c) = sqrt(1 - c) poly(c) for c >= 0, within 2e-8; below 0 it is pi - acos(-c). GLSL's own acos may be off by 1e-3.
    float v = clamp(versine, 0.0, 2.0);
    float c = abs(1.0 - v);
    float poly = -0.0012624911;
    poly = poly * c + 0.0066700901;
    poly = poly * c - 0.0170881256;
    poly = poly * c + 0.0308918810;
    poly = poly * c - 0.0501743046;
    poly = poly * c + 0.0889789874;
    poly = poly * c - 0.2145988016;
    poly = poly * c + 1.5707963050;
    float theta = sqrt(min(v, 2.0 - v)) * poly;
    theta = v > 1.0 ? 3.14159265 - theta : theta;
    return exp(-theta * theta * sharpness);
}
