// SPDX-License-Identifier: MIT
/* srbfChangedExchange: what other albedo adds to one entry of the exchange of light between a transfer asset's shapes.
   use:    vec3 srbfChangedExchange(highp sampler2D gather, highp sampler2D sent, highp sampler2D albedo, int count, ivec2 at)
   domain: gather, sent: a row per shape, a column per surfel, one channel; albedo: of each surfel now in column 0, of the bake in column 1;
           count: surfels; at: column and row of the exchange
   twin:   srbf.methods.surface_changes.Surfaces.repainted
   cite:   - */
vec3 srbfChangedExchange(highp sampler2D gather, highp sampler2D sent, highp sampler2D albedo, int count, ivec2 at) {
    vec3 total = vec3(0.0);
    for (int k = 0; k < count; ++k) {
        vec3 change = texelFetch(albedo, ivec2(0, k), 0).rgb - texelFetch(albedo, ivec2(1, k), 0).rgb;
        total += texelFetch(gather, ivec2(k, at.y), 0).r * texelFetch(sent, ivec2(k, at.x), 0).r * change;
    }
    return total;
}
