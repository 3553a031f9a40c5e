// SPDX-License-Identifier: MIT
/* srbfNeuralCodes: what the code of each texel adds to the first hidden layer of a neural decoder, the same for all lights.
   use:    void srbfNeuralCodes(sampler2DArray planes, vec2 uv, float level, vec4 network[SRBF_NETWORK], vec4 scale[SRBF_LAYERS],
                                vec4 bias[SRBF_LAYERS], out vec4 units[SRBF_UNIT_VECTORS])
   domain: planes four numbers of the code per layer, nearest, since the light of a mean of codes is no mean of light; level: mip level,
           0 without mip maps; network the rows of network.exr, SRBF_UNIT_VECTORS vec4 per row, and of the last row the first; scale, bias
           of the layers, from asset.json, 0 in channels past the last number
   twin:   srbf.basis.neural_decoder.NeuralDecoder.of_codes
   cite:   Dulecha2020 */
#include "combine/decode_components.glsl"

#ifndef SRBF_COMPONENTS
#error define SRBF_COMPONENTS: numbers in a code
#endif
#ifndef SRBF_UNIT_VECTORS
#error define SRBF_UNIT_VECTORS: a quarter of the units in a hidden layer
#endif
#ifndef SRBF_LAYERS
#define SRBF_LAYERS ((SRBF_COMPONENTS + 3) / 4)
#endif
#ifndef SRBF_NETWORK
#define SRBF_NETWORK ((SRBF_COMPONENTS + 4 * SRBF_UNIT_VECTORS + 8) * SRBF_UNIT_VECTORS + 1)
#endif

void srbfNeuralCodes(highp sampler2DArray planes, vec2 uv, float level, vec4 network[SRBF_NETWORK], vec4 scale[SRBF_LAYERS],
                     vec4 bias[SRBF_LAYERS], out vec4 units[SRBF_UNIT_VECTORS]) {
    for (int u = 0; u < SRBF_UNIT_VECTORS; ++u) {
        units[u] = network[(SRBF_COMPONENTS + 3) * SRBF_UNIT_VECTORS + u];
    }
    for (int i = 0; i < SRBF_LAYERS; ++i) {
        vec4 code = srbfDecodeComponents(textureLod(planes, vec3(uv, float(i)), level), scale[i], bias[i]);
        for (int u = 0; u < SRBF_UNIT_VECTORS; ++u) {
            int row = 4 * i * SRBF_UNIT_VECTORS + u;  // rows past the code's are of the network, too, and unused channels are 0
            units[u] += code.x * network[row] + code.y * network[row + SRBF_UNIT_VECTORS];
            units[u] += code.z * network[row + 2 * SRBF_UNIT_VECTORS] + code.w * network[row + 3 * SRBF_UNIT_VECTORS];
        }
    }
}
