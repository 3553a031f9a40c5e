// SPDX-License-Identifier: MIT
/* srbfWeightCurve: R_i for one light direction as 2 to the power of a polynomial in the versine: no table, arccosine, root or branch.
   use:    float srbfWeightCurve(float versine, vec4 curve, float last)
   domain: versine = 1 - cos theta in [0, 2], clipped to it; curve, last: coefficients of the first to the fourth power, and of the fifth,
           from srbf.basis.gaussian.weight_curve for the spread; result in [0, 1], up to its error
   twin:   srbf.basis.gaussian.WeightCurve.evaluate
   cite:   Wong2005, eq. 2 */
float srbfWeightCurve(float versine, vec4 curve, float last) {
    float v = clamp(versine, 0.0, 2.0);
    return exp2(v * (curve.x + v * (curve.y + v * (curve.z + v * (curve.w + v * last)))));
}
