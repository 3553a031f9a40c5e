// SPDX-License-Identifier: MIT
/* srbfProbeNode: one of the eight nodes of the grid of probes around a place.
   use:    ivec3 srbfProbeNode(vec4 grid, ivec3 counts, int corner, vec3 place)
   domain: as srbfProbeWeight; along an axis of one node all corners are that node
   twin:   srbf.probe_grid.ProbeGrid.weights
   cite:   Majercik2019 */
ivec3 srbfProbeNode(vec4 grid, ivec3 counts, int corner, vec3 place) {
    ivec3 most = counts - 1;
    vec3 at = clamp((place - grid.xyz) / grid.w, vec3(0.0), vec3(most));
    ivec3 low = min(ivec3(at), max(most - 1, ivec3(0)));
    return min(low + ivec3(corner % 2, corner / 2 % 2, corner / 4), most);
}
