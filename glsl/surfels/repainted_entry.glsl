// SPDX-License-Identifier: MIT
/* srbfRepaintedEntry: what other albedo adds to one entry of a transfer asset's table, all bounces included.
   use:    vec3 srbfRepaintedEntry(highp sampler2D before, highp sampler2D after, highp sampler2D gather, highp sampler2D albedo, int rank,
                                   float beforeScale, ivec2 at)
   domain: before, after: sums over k of the exchange to the power k, rank x rank, the former times beforeScale; gather: a row per shape, a
           column per surfel, one channel; albedo: of each surfel now in column 0, of the bake in column 1; at: surfel and shape
   twin:   srbf.methods.surface_changes.Surfaces.repainted
   cite:   - */
vec3 srbfRepaintedEntry(highp sampler2D before, highp sampler2D after, highp sampler2D gather, highp sampler2D albedo, int rank,
                        float beforeScale, ivec2 at) {
    vec3 now = texelFetch(albedo, ivec2(0, at.x), 0).rgb;
    vec3 former = texelFetch(albedo, ivec2(1, at.x), 0).rgb * beforeScale;
    vec3 total = vec3(0.0);
    for (int k = 0; k < rank; ++k) {
        vec3 reflected = texelFetch(after, ivec2(k, at.y), 0).rgb * now - texelFetch(before, ivec2(k, at.y), 0).rgb * former;
        total += reflected * texelFetch(gather, ivec2(at.x, k), 0).r;
    }
    return total;
}
