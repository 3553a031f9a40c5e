// SPDX-License-Identifier: MIT
/* srbfProbeHarmonics: a texel of the harmonics of a probe's light, as srbfProbeIrradiance takes them, from the picture of its facets.
   use:    vec4 srbfProbeHarmonics(highp sampler2D facets, highp sampler2D places, vec4 weights[84], int width, ivec2 at)
   domain: facets: the relit picture of an asset of probes; places: its image of that name; width: nodes in a row; at: column and row of the
           target, 7 width wide; weights: of texel t and facet f at 12 t + f, for the four numbers of the texel
   twin:   srbf.relighting.probe_light.harmonics
   cite:   Ramamoorthi2001 */
vec4 srbfProbeHarmonics(highp sampler2D facets, highp sampler2D places, vec4 weights[84], int width, ivec2 at) {
    int own = at.x % width;
    int texel = at.x / width;
    int source = int(texelFetch(places, ivec2(own, at.y), 0).w + 0.5);
    vec4 sum = vec4(0.0);
    for (int facet = 0; facet < 12; ++facet) {
        vec3 light = texelFetch(facets, ivec2(facet * width + source % width, source / width), 0).rgb;
        vec4 four = vec4(light.x, light.y, light.z, light.x);  // numbers run over colors, then harmonics
        if (texel % 3 == 1) {
            four = vec4(light.y, light.z, light.x, light.y);
        }
        if (texel % 3 == 2) {
            four = vec4(light.z, light.x, light.y, light.z);
        }
        sum += weights[texel * 12 + facet] * four;
    }
    return sum;
}
