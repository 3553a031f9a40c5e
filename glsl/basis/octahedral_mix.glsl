// SPDX-License-Identifier: MIT
/* srbfOctahedralMix: one light function at a node and fraction of its tile, by four fetches and a mix.
   use:    vec3 srbfOctahedralMix(sampler2D wTable, int tableSize, int index, vec4 node)
   domain: wTable an atlas of tiles of tableSize x tableSize nodes, tile `index` counted row by row; node from srbfOctahedralNode, the
           same for every function of a light direction; nodes lie on the borders, so that no fold needs a neighbor outside the tile
   twin:   srbf.basis.octahedral_table.lookup
   cite:   Cigolle2014 */
vec3 srbfOctahedralMix(highp sampler2D wTable, int tableSize, int index, vec4 node) {
    // Never the hardware's filter: its fractions have 8 bits, and it would mix tiles.
    int columns = textureSize(wTable, 0).x / tableSize;
    int row = int((float(index) + 0.5) / float(columns));  // exact below 2^22 tiles; GPUs divide integers slowly
    ivec2 at = ivec2(index - row * columns, row) * tableSize + ivec2(node.xy);
    vec3 top = mix(texelFetch(wTable, at, 0).rgb, texelFetch(wTable, at + ivec2(1, 0), 0).rgb, node.z);
    vec3 bottom = mix(texelFetch(wTable, at + ivec2(0, 1), 0).rgb, texelFetch(wTable, at + ivec2(1, 1), 0).rgb, node.z);
    return mix(top, bottom, node.w);
}
