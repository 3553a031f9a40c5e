// SPDX-License-Identifier: MIT
/* srbfLobeAlbedo: the albedo of a specular lobe whose Fresnel term is 1, and what share of it Schlick's term is, bilinear from a table.
   use:    vec2 srbfLobeAlbedo(sampler2D lobeAlbedo, float NoV, float alpha)
   domain: lobeAlbedo: rows by the cosine to the eye from 0.02 to 1, columns by the roughness, the root of alpha, from 0 to 1
   twin:   srbf.microfacets.albedo_terms
   cite:   - */
vec2 srbfLobeAlbedo(highp sampler2D lobeAlbedo, float NoV, float alpha) {
    const float GRAZING = 0.02;
    ivec2 last = textureSize(lobeAlbedo, 0) - ivec2(1);
    vec2 most = vec2(float(last.x), float(last.y));
    vec2 place = clamp(vec2(sqrt(alpha), (NoV - GRAZING) / (1.0 - GRAZING)), vec2(0.0), vec2(1.0)) * most;
    ivec2 low = ivec2(min(int(place.x), last.x - 1), min(int(place.y), last.y - 1));
    vec2 part = place - vec2(float(low.x), float(low.y));
    vec2 top = mix(texelFetch(lobeAlbedo, low, 0).rg, texelFetch(lobeAlbedo, low + ivec2(1, 0), 0).rg, part.x);
    vec2 bottom = mix(texelFetch(lobeAlbedo, low + ivec2(0, 1), 0).rg, texelFetch(lobeAlbedo, low + ivec2(1, 1), 0).rg, part.x);
    return mix(top, bottom, part.y);
}
