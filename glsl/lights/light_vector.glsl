// SPDX-License-Identifier: MIT
/* srbfLightVector: L = S - P, from the receiver to the point light, not normalized.
   use:    vec3 srbfLightVector(vec3 position, vec3 positionLow, vec3 receiver)
   domain: meters, one frame for all three; positionLow is what single precision dropped of the light's position, or vec3(0.0)
   twin:   numpy.subtract
   cite:   Wong2005, eq. 3 */
vec3 srbfLightVector(vec3 position, vec3 positionLow, vec3 receiver) {
    return (position - receiver) + positionLow;
}
