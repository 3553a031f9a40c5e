// SPDX-License-Identifier: MIT
/* srbfOctahedralNode: the table node up and left of a place of the octahedral square (.xy), and how far past it the place is (.zw).
   use:    vec4 srbfOctahedralNode(int tableSize, vec2 place)
   domain: place in [-1, 1], from srbfOctahedralEncode; result: whole numbers in [0, tableSize - 2], fractions in [0, 1]
   twin:   srbf.basis.octahedral_table.lookup
   cite:   Cigolle2014 */
vec4 srbfOctahedralNode(int tableSize, vec2 place) {
    // The place is counted from the middle of the tile, so that the fraction keeps the precision of the place itself.
    float middle = 0.5 * float(tableSize - 1);
    vec2 fromMiddle = place * middle;
    vec2 node = clamp(floor(fromMiddle + middle), vec2(0.0), vec2(float(tableSize - 2)));
    return vec4(node, fromMiddle - (node - middle));
}
