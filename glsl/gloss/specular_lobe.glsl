// SPDX-License-Identifier: MIT
/* srbfSpecularLobe: what a GGX lobe reflects toward the eye of a light that gives a surface facing it an irradiance of 1: f NoL.
   use:    vec3 srbfSpecularLobe(sampler2D lobeAlbedo, vec3 normal, vec3 toEye, vec3 toLight, vec3 color, float alpha, float share, float spread)
   domain: unit vectors; color: the lobe's whole albedo, of which a share follows Schlick's term; alpha: above 0; spread: half the angle
           (rad) that the light fills, 0 of a point; lobeAlbedo as srbfLobeAlbedo
   twin:   srbf.microfacets.reflected
   cite:   Walter2007, Heitz2018, Schlick1994 */
#include "gloss/lobe_albedo.glsl"

vec3 srbfSpecularLobe(highp sampler2D lobeAlbedo, vec3 normal, vec3 toEye, vec3 toLight, vec3 color, float alpha, float share,
                      float spread) {
    const float PI = 3.14159265358979;
    vec3 between = toEye + toLight;
    vec3 middle = between / max(length(between), 1e-20);
    float NoL = dot(normal, toLight);
    float NoV = max(dot(normal, toEye), 1e-3);
    if (NoL <= 0.0) {
        return vec3(0.0);
    }
    float NoH = dot(normal, middle);
    vec3 off = cross(normal, middle);
    float squared = alpha * alpha + 0.25 * spread * spread;
    float width = NoH * NoH * squared + dot(off, off);  // 1 + NoH^2 (alpha^2 - 1), without cancellation
    float masked = sqrt(1.0 + squared * max(1.0 - NoV * NoV, 0.0) / (NoV * NoV)) + sqrt(1.0 + squared * max(1.0 - NoL * NoL, 0.0) / max(NoL * NoL, 1e-12));
    float amount = squared / (PI * width * width) * 2.0 / masked / (4.0 * NoV);
    vec2 terms = srbfLobeAlbedo(lobeAlbedo, NoV, alpha);
    vec3 along = clamp((color - terms.y) / max(1.0 - terms.y, 1e-6), vec3(0.0), vec3(1.0));  // Fresnel term along the normal
    float grazing = pow(1.0 - clamp(dot(toEye, middle), 0.0, 1.0), 5.0);
    vec3 term = (along + (1.0 - along) * grazing) / max(along * (1.0 - terms.y) + terms.y, vec3(1e-9));
    return color * (1.0 - share + share * term) * (amount / terms.x);
}
