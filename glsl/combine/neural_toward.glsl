// SPDX-License-Identifier: MIT
/* srbfNeuralToward: the response to a white light from a direction, by a neural decoder: two hidden layers and three colors.
   use:    vec3 srbfNeuralToward(vec4 units[SRBF_UNIT_VECTORS], vec3 direction, vec4 network[SRBF_NETWORK])
   domain: units from srbfNeuralCodes; direction a unit vector from the surface to the light, in the asset's frame; network as there;
           result signed, per unit of the light's strength
   twin:   srbf.basis.neural_decoder.NeuralDecoder.toward
   cite:   Dulecha2020 */
#include "basis/elu.glsl"

#ifndef SRBF_COMPONENTS
#error define SRBF_COMPONENTS: numbers in a code
#endif
#ifndef SRBF_UNIT_VECTORS
#error define SRBF_UNIT_VECTORS: a quarter of the units in a hidden layer
#endif
#ifndef SRBF_NETWORK
#define SRBF_NETWORK ((SRBF_COMPONENTS + 4 * SRBF_UNIT_VECTORS + 8) * SRBF_UNIT_VECTORS + 1)
#endif

vec3 srbfNeuralToward(vec4 units[SRBF_UNIT_VECTORS], vec3 direction, vec4 network[SRBF_NETWORK]) {
    const int toward = SRBF_COMPONENTS * SRBF_UNIT_VECTORS;
    const int hidden = toward + 4 * SRBF_UNIT_VECTORS;
    const int hiddenBias = hidden + 4 * SRBF_UNIT_VECTORS * SRBF_UNIT_VECTORS;
    const int colors = hiddenBias + SRBF_UNIT_VECTORS;
    vec4 second[SRBF_UNIT_VECTORS];
    for (int u = 0; u < SRBF_UNIT_VECTORS; ++u) {
        second[u] = network[hiddenBias + u];
    }
    for (int v = 0; v < SRBF_UNIT_VECTORS; ++v) {
        vec4 first = units[v] + direction.x * network[toward + v];
        first += direction.y * network[toward + SRBF_UNIT_VECTORS + v] + direction.z * network[toward + 2 * SRBF_UNIT_VECTORS + v];
        first = srbfElu(first);
        for (int u = 0; u < SRBF_UNIT_VECTORS; ++u) {
            int row = hidden + 4 * v * SRBF_UNIT_VECTORS + u;
            second[u] += first.x * network[row] + first.y * network[row + SRBF_UNIT_VECTORS];
            second[u] += first.z * network[row + 2 * SRBF_UNIT_VECTORS] + first.w * network[row + 3 * SRBF_UNIT_VECTORS];
        }
    }
    vec3 sum = network[colors + 3 * SRBF_UNIT_VECTORS].xyz;
    for (int u = 0; u < SRBF_UNIT_VECTORS; ++u) {
        vec4 unit = srbfElu(second[u]);
        sum.r += dot(unit, network[colors + u]);
        sum.g += dot(unit, network[colors + SRBF_UNIT_VECTORS + u]);
        sum.b += dot(unit, network[colors + 2 * SRBF_UNIT_VECTORS + u]);
    }
    return sum;
}
