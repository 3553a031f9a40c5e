// SPDX-License-Identifier: MIT
/* srbfProfile: what factor a profile of a light puts on its color in a direction, bilinear.
   use:    vec3 srbfProfile(sampler2D profile, vec3 fromLight, vec3 axis, vec3 across, vec3 up, float tangent)
   domain: profile: rows from the axis (0) to its opposite (pi), columns by the azimuth atan(x, y) + pi, the ends included, or, with a
           tangent above 0, an image over the square that reaches so far to each side 1 m ahead; across (x), up (y) and axis: orthonormal;
           fromLight of any length but 0
   twin:   srbf.light_profile.Profile.at
   cite:   - */
vec3 srbfProfile(highp sampler2D profile, vec3 fromLight, vec3 axis, vec3 across, vec3 up, float tangent) {
    const float PI = 3.14159265358979;
    float x = dot(fromLight, across);
    float y = dot(fromLight, up);
    float ahead = dot(fromLight, axis);
    ivec2 last = textureSize(profile, 0) - ivec2(1);
    vec2 most = vec2(float(last.x), float(last.y));
    vec2 place = vec2(0.0);
    if (tangent > 0.0) {
        if (ahead <= 0.0) {
            return vec3(0.0);
        }
        vec2 side = vec2(x, -y) * (0.5 / (ahead * tangent)) + 0.5;
        place = clamp(side * (most + 1.0) - 0.5, vec2(0.0), most);
    } else {
        float off = length(vec2(x, y));
        float azimuth = off > 0.0 ? atan(x, y) : 0.0;
        float polar = off > 0.0 ? atan(off, ahead) : (ahead < 0.0 ? PI : 0.0);
        place = clamp(vec2(azimuth / (2.0 * PI) + 0.5, polar / PI) * most, vec2(0.0), most);
    }
    ivec2 low = ivec2(place);
    ivec2 high = ivec2(min(low.x + 1, last.x), min(low.y + 1, last.y));
    vec2 part = place - vec2(float(low.x), float(low.y));
    vec3 top = mix(texelFetch(profile, low, 0).rgb, texelFetch(profile, ivec2(high.x, low.y), 0).rgb, part.x);
    vec3 bottom = mix(texelFetch(profile, ivec2(low.x, high.y), 0).rgb, texelFetch(profile, high, 0).rgb, part.x);
    return mix(top, bottom, part.y);
}
