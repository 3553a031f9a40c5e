// SPDX-License-Identifier: MIT
/* srbfCenterWeight: R_i of one light direction: by the table, by pairs where SRBF_PAIRS is defined, by formula where SRBF_FORMULA is, by the
   curve of the spread where SRBF_CURVE is.
   use:    float srbfCenterWeight(sampler2D rTable, vec3 lightDirection, vec4 center)
   domain: lightDirection of length 1, or 0 where the receiver coincides with the point light; center.xyz unit; with SRBF_PAIRS rTable
           holds what srbfWeightPairs takes; with SRBF_FORMULA center.w is 1 / (2 spread^2) and rTable is not read; SRBF_CURVE and
           SRBF_CURVE_LAST are the last arguments of srbfWeightCurve, and neither is read
   twin:   srbf.methods.relighting_map.basis_weights
   cite:   Wong2005, fig. 8 and 9 */
#include "basis/weight.glsl"
#include "basis/weight_curve.glsl"
#include "basis/weight_formula.glsl"
#include "basis/weight_pairs.glsl"
#include "lights/versine.glsl"

float srbfCenterWeight(highp sampler2D rTable, vec3 lightDirection, vec4 center) {
    float versine = srbfVersine(lightDirection, center.xyz);
#ifdef SRBF_CURVE
    return srbfWeightCurve(versine, SRBF_CURVE, SRBF_CURVE_LAST);
#else
#ifdef SRBF_FORMULA
    return srbfWeightFormula(versine, center.w);
#else
#ifdef SRBF_PAIRS
    return srbfWeightPairs(rTable, versine);
#else
    return srbfWeight(rTable, 1.0 - versine);
#endif
#endif
#endif
}
