// SPDX-License-Identifier: MIT
/* srbfProbeWeight: how much one of the eight probes around a place adds to its light, before all are scaled to add up to 1: trilinear, times
   what the probe sees of the place.
   use:    float srbfProbeWeight(highp sampler2D places, highp sampler2D nearness, vec4 grid, ivec3 counts, int corner, vec3 place)
   domain: grid: origin and spacing, m, counts of nodes, as asset.json has them; places and nearness: its two images; corner 0 to 7, x first;
           place in m, the asset's frame, anywhere: beyond the grid the outermost probes hold on
   twin:   srbf.probe_grid.ProbeGrid.weights
   cite:   Majercik2019 */
#include "basis/octahedral_encode.glsl"
#include "basis/octahedral_lookup.glsl"
#include "probes/probe_node.glsl"

float srbfProbeWeight(highp sampler2D places, highp sampler2D nearness, vec4 grid, ivec3 counts, int corner, vec3 place) {
    const int TILE = 17;
    const float UNSEEN = 1e-5;  // beside those that see the place, so that one that no probe sees has light, too
    const float SOFT = 0.1;  // of a surface's distance: how far behind it a weight falls to nothing
    ivec3 node = srbfProbeNode(grid, counts, corner, place);
    vec3 shares = 1.0 - abs(clamp((place - grid.xyz) / grid.w, vec3(0.0), vec3(counts - 1)) - vec3(node));
    vec4 probe = texelFetch(places, ivec2(node.x, node.z * counts.y + node.y), 0);
    int source = int(probe.w + 0.5);
    vec3 way = place - probe.xyz;
    float surface = srbfOctahedralLookup(nearness, TILE, source, srbfOctahedralEncode(way)).r;
    float seen = clamp(1.0 - (length(way) * surface - 1.0) / SOFT, 0.0, 1.0);
    float own = source == node.x + counts.x * (node.y + counts.y * node.z) ? 1.0 : UNSEEN;
    return shares.x * shares.y * shares.z * max(seen * seen, UNSEEN) * own;
}
