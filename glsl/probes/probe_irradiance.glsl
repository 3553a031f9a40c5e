// SPDX-License-Identifier: MIT
/* srbfProbeIrradiance: irradiance on a surface between probes, mixed from the eight around it without light through walls; not negative.
   use:    vec3 srbfProbeIrradiance(highp sampler2D light, highp sampler2D places, highp sampler2D nearness, vec4 grid, ivec3 counts,
                                    vec3 place, vec3 normal)
   domain: light: nine RGB harmonics of the radiance at every node, l <= 2, one after the other in seven texels, texel t of node (x, y, z) in
           column t counts.x + x, row z counts.y + y; place and unit normal in the asset's frame; the rest as srbfProbeWeight. 96 fetches
   twin:   srbf.relighting.probe_light.light_at
   cite:   Ramamoorthi2001 */
#include "probes/probe_node.glsl"
#include "probes/probe_weight.glsl"

vec3 srbfProbeIrradiance(highp sampler2D light, highp sampler2D places, highp sampler2D nearness, vec4 grid, ivec3 counts, vec3 place,
                         vec3 normal) {
    float total = 0.0;
    vec4 a = vec4(0.0);
    vec4 b = vec4(0.0);
    vec4 c = vec4(0.0);
    vec4 d = vec4(0.0);
    vec4 e = vec4(0.0);
    vec4 f = vec4(0.0);
    vec4 g = vec4(0.0);
    for (int corner = 0; corner < 8; ++corner) {
        float share = srbfProbeWeight(places, nearness, grid, counts, corner, place);
        ivec3 node = srbfProbeNode(grid, counts, corner, place);
        ivec2 at = ivec2(node.x, node.z * counts.y + node.y);
        ivec2 next = ivec2(counts.x, 0);
        total += share;
        a += share * texelFetch(light, at, 0);
        b += share * texelFetch(light, at + next, 0);
        c += share * texelFetch(light, at + 2 * next, 0);
        d += share * texelFetch(light, at + 3 * next, 0);
        e += share * texelFetch(light, at + 4 * next, 0);
        f += share * texelFetch(light, at + 5 * next, 0);
        g += share * texelFetch(light, at + 6 * next, 0);
    }
    // Each harmonic times what the cosine lobe leaves of it: pi, 2 pi / 3, pi / 4.
    vec3 n = normal;
    vec3 sum = 0.886226925 * vec3(a.x, a.y, a.z);
    sum += 1.023326708 * (n.y * vec3(a.w, b.x, b.y) + n.z * vec3(b.z, b.w, c.x) + n.x * vec3(c.y, c.z, c.w));
    sum += 0.858085531 * (n.x * n.y * vec3(d.x, d.y, d.z) + n.y * n.z * vec3(d.w, e.x, e.y) + n.x * n.z * vec3(f.y, f.z, f.w));
    sum += 0.247707956 * (3.0 * n.z * n.z - 1.0) * vec3(e.z, e.w, f.x) + 0.429042765 * (n.x * n.x - n.y * n.y) * vec3(g.x, g.y, g.z);
    return max(sum / total, vec3(0.0));
}
