// SPDX-License-Identifier: MIT
/* srbfFinish: the relit value: the sum over all lights, clamped once, plus what the scene emits by itself.
   use:    vec3 srbfFinish(vec3 sum, vec3 ambient)
   domain: sum signed, complete over all maps and lights and after any texture filtering; ambient zero where the asset has none
   twin:   srbf.methods.relight
   cite:   Wong2005, eq. 1; the clamp and the ambient image are ours */
vec3 srbfFinish(vec3 sum, vec3 ambient) {
    return max(sum, vec3(0.0)) + ambient;
}
