// SPDX-License-Identifier: MIT
/* srbfPcaVisibility: how much of a light a point sees, 0 to 1: four depths around its direction, each compared, the results mixed.
   use:    float srbfPcaVisibility(highp sampler2D coefficients, highp sampler2D bases, int point, int cluster, int groups, vec2 place,
                                   float lightDistance)
   domain: place: srbfHemispherePlace of the light; lightDistance in m, of a sun 1.05 `far` / 0.95; a light with a size: the mean of 25 places
           of it, weighted by the light that each adds; the rest as srbfPcaDepth
   twin:   srbf.visibility.pca_visibility.PcaVisibility.visible
   cite:   Nowrouzezahrai2007 */
#include "shadow/pca_depth.glsl"

float srbfPcaVisibility(highp sampler2D coefficients, highp sampler2D bases, int point, int cluster, int groups, vec2 place,
                        float lightDistance) {
    const float SIDE = 45.0;
    const float REACH = 0.95;  // of the distance: errors of the components shade less than they would
    vec2 at = place * SIDE - 0.5;
    vec2 base = floor(at);
    vec2 part = at - base;
    float seen = 0.0;
    for (int corner = 0; corner < 4; ++corner) {
        vec2 step = vec2(float(corner % 2), float(corner / 2));
        vec2 weight = mix(1.0 - part, part, step);
        ivec2 tap = ivec2(clamp(base + step, vec2(0.0), vec2(SIDE - 1.0)));
        float depth = srbfPcaDepth(coefficients, bases, point, cluster, groups, tap.y * int(SIDE) + tap.x);
        seen += REACH * lightDistance <= depth ? weight.x * weight.y : 0.0;
    }
    return seen;
}
