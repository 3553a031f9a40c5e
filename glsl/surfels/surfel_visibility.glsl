// SPDX-License-Identifier: MIT
/* srbfSurfelVisibility: how much of a light a surfel sees, 0 to 1, by a map of one over the depth; the surfel's normal may be a mean over
   several faces, so that nothing is known of the plane that it is on.
   use:    float srbfSurfelVisibility(highp sampler2D heights, ivec2 corner, int width, vec3 place)
   domain: corner: first texel of the map in `heights`, `width` texels a side; place: of a point just above a surface, by srbfPointShadowPlace
   twin:   srbf.visibility.received.RayShadows.visible
   cite:   - */
float srbfSurfelVisibility(highp sampler2D heights, ivec2 corner, int width, vec3 place) {
    const float EDGE = 0.1;    // of the depth: what is nearer by more is another surface
    const float SLACK = 1e-4;  // of the depth, of rounding
    vec2 at = place.xy * float(width) - 0.5;
    vec2 base = clamp(floor(at), vec2(0.0), vec2(float(width - 2)));
    vec2 part = at - base;  // past the middles of the outermost texels the plane goes on
    float nearer = 0.0;
    float excess = 0.0;  // on the surfel's own surface 0: one over the depth of a plane is linear on the map
    for (int tap = 0; tap < 4; ++tap) {
        vec2 step = vec2(float(tap % 2), float(tap / 2));
        vec2 share = mix(1.0 - part, part, step);
        ivec2 texel = corner + ivec2(base + step);
        float own = max(texelFetch(heights, texel, 0).r / place.z - 1.0, -EDGE);
        nearer += own > EDGE ? share.x * share.y : 0.0;
        excess += share.x * share.y * own;
    }
    return nearer != 0.0 ? clamp(1.0 - nearer, 0.0, 1.0) : (excess > SLACK ? 0.0 : 1.0);
}
