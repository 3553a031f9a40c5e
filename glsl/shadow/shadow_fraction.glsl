// SPDX-License-Identifier: MIT
/* srbfShadowFraction: how much of a 3 x 3 texel neighborhood is not above a receiver, by percentage-closer filtering.
   use:    float srbfShadowFraction(highp sampler2D heights, vec2 uv, float height, vec2 slope, float bias)
   domain: heights: the nearest occluder's, along the light; slope: rise of the receiver's plane per map texel in x and in y. All in meters
           for a sun; one over meters of depth for a light inside the scene
   twin:   srbf.visibility.shadow.fraction
   cite:   Reeves1987 */
float srbfShadowFraction(highp sampler2D heights, vec2 uv, float height, vec2 slope, float bias) {
    ivec2 size = textureSize(heights, 0);
    vec2 place = uv * vec2(size) - 0.5;
    vec2 base = floor(place);
    vec2 part = place - base;
    float lit = 0.0;
    for (int j = -1; j <= 2; ++j) {
        for (int i = -1; i <= 2; ++i) {
            vec2 weight = vec2(i == -1 ? 1.0 - part.x : (i == 2 ? part.x : 1.0), j == -1 ? 1.0 - part.y : (j == 2 ? part.y : 1.0));
            vec2 tap = base + vec2(float(i), float(j));
            float occluder = texelFetch(heights, clamp(ivec2(tap), ivec2(0), size - 1), 0).r;
            float plane = height + dot(slope, tap - place);
            lit += occluder <= plane + bias ? weight.x * weight.y : 0.0;
        }
    }
    return lit / 9.0;
}
