// SPDX-License-Identifier: MIT
/* srbfTransmittance: what one wall of a translucent material lets through of light that meets its normal at a cosine.
   use:    vec3 srbfTransmittance(vec4 curve[8], float cosine)
   domain: curve: tint_by_cosine of scene.glb, at the cosines 0, 1/7, ... 1; cosine in [-1, 1], either side of the wall
   twin:   srbf.visibility.shadow.transmittance
   cite:   - */
vec3 srbfTransmittance(vec4 curve[8], float cosine) {
    float place = min(abs(cosine), 1.0) * 7.0;
    int knot = min(int(place), 6);
    return mix(curve[knot].rgb, curve[knot + 1].rgb, place - float(knot));
}
