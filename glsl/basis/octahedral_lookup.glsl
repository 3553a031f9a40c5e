// SPDX-License-Identifier: MIT
/* srbfOctahedralLookup: one light function at a place of the octahedral square, by four fetches from its tile and a mix.
   use:    vec3 srbfOctahedralLookup(sampler2D wTable, int tableSize, int index, vec2 place)
   domain: wTable an atlas of tiles of tableSize x tableSize nodes, tile `index` counted row by row; place from
           srbfOctahedralEncode; nodes lie on the borders, so that no fold needs a neighbor outside the tile
   twin:   srbf.basis.octahedral_table.lookup
   cite:   Cigolle2014 */
#include "basis/octahedral_mix.glsl"
#include "basis/octahedral_node.glsl"

vec3 srbfOctahedralLookup(highp sampler2D wTable, int tableSize, int index, vec2 place) {
    return srbfOctahedralMix(wTable, tableSize, index, srbfOctahedralNode(tableSize, place));
}
