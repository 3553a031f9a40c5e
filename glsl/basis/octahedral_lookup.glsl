// SPDX-License-Identifier: MIT
/* srbfOctahedralLookup: one light function at a place of the octahedral square, by four fetches from its tile and a mix.
   use:    vec3 srbfOctahedralLookup(sampler2D wTable, int tableSize, int index, vec2 place)
   domain: wTable an atlas of tiles of tableSize x tableSize nodes, tile `index` counted row by row; place from
           srbfOctahedralEncode; nodes stand on the borders, so that no fold needs a neighbour outside the tile
   twin:   srbf.basis.octahedral_table.lookup
   cite:   Cigolle2014 */
vec3 srbfOctahedralLookup(highp sampler2D wTable, int tableSize, int index, vec2 place) {
    // Never the hardware's filter: its fractions have 8 bits, and it would mix tiles. The place is counted from the middle of
    // the tile, so that the fraction keeps the precision of the place itself.
    float middle = 0.5 * float(tableSize - 1);
    vec2 fromMiddle = place * middle;
    ivec2 node = clamp(ivec2(floor(fromMiddle + middle)), ivec2(0), ivec2(tableSize - 2));
    vec2 fraction = fromMiddle - (vec2(node) - middle);
    int columns = textureSize(wTable, 0).x / tableSize;
    int row = int((float(index) + 0.5) / float(columns));  // exact below 2^22 tiles; GPUs divide integers slowly
    ivec2 at = ivec2(index - row * columns, row) * tableSize + node;
    vec3 top = mix(texelFetch(wTable, at, 0).rgb, texelFetch(wTable, at + ivec2(1, 0), 0).rgb, fraction.x);
    vec3 bottom = mix(texelFetch(wTable, at + ivec2(0, 1), 0).rgb, texelFetch(wTable, at + ivec2(1, 1), 0).rgb, fraction.x);
    return mix(top, bottom, fraction.y);
}
