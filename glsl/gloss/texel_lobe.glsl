// SPDX-License-Identifier: MIT
/* srbfTexelLobe: srbfSpecularLobe with the albedo and roughness stored per texel; 0 where the texel has no lobe.
   use:    vec3 srbfTexelLobe(sampler2D glossy, sampler2D lobes, sampler2D lobeAlbedo, ivec2 texel, vec3 point, vec3 normal, vec4 eye,
                              vec3 toLight, float spread)
   domain: glossy: whole albedo; lobes: roughness, share with a Fresnel term, above 0 where there is a lobe; eye: a place, m, in the frame
           of the point, and 1, or the unit direction to it and 0; the rest as srbfSpecularLobe
   twin:   srbf.visibility.glossy_direct.GlossyPixels.reflected
   cite:   - */
#include "gloss/specular_lobe.glsl"

vec3 srbfTexelLobe(highp sampler2D glossy, highp sampler2D lobes, highp sampler2D lobeAlbedo, ivec2 texel, vec3 point, vec3 normal,
                   vec4 eye, vec3 toLight, float spread) {
    const float LEAST = 1e-4;  // albedo, and cosine to the light, that count
    const float LEAST_ALPHA = 1e-3;
    vec3 color = texelFetch(glossy, texel, 0).rgb;
    vec3 lobe = texelFetch(lobes, texel, 0).rgb;
    if (lobe.b <= 0.0 || max(color.r, max(color.g, color.b)) <= LEAST || dot(normal, toLight) <= LEAST) {
        return vec3(0.0);
    }
    vec3 toEye = eye.xyz - eye.w * point;
    toEye /= max(length(toEye), 1e-20);
    return srbfSpecularLobe(lobeAlbedo, normal, toEye, toLight, color, max(lobe.r * lobe.r, LEAST_ALPHA), lobe.g, spread);
}
