// SPDX-License-Identifier: MIT
/* srbfEnvironmentTexel: where a texel of an equirectangular map is (.xyz, unit) and the solid angle that it fills (.w, sr).
   use:    vec4 srbfEnvironmentTexel(ivec2 texel, ivec2 size, bool cut)
   domain: u = 1/2 - atan2(y, x) / 2 pi, row 0 towards +z; cut: what is below the map's own horizon has solid angle 0, and a row that
           straddles it is cut there, its center the middle of what is left
   twin:   srbf.light_geometry.environment_samples
   cite:   - */
#include "lights/sine_cosine.glsl"

vec4 srbfEnvironmentTexel(ivec2 texel, ivec2 size, bool cut) {
    // elevations in right angles, times the rows: whole numbers
    int lowest = cut ? 0 : -size.y;
    int top = max(size.y - 2 * texel.y, lowest);
    int bottom = max(size.y - 2 * (texel.y + 1), lowest);
    vec2 elevation = srbfSineCosine(top + bottom, 2 * size.y);
    vec2 azimuth = srbfSineCosine(2 * (size.x - 2 * texel.x - 1), size.x);
    // sin a - sin b without subtracting numbers near 1
    float solidAngle = 2.0 * elevation.y * srbfSineCosine(top - bottom, 2 * size.y).x * (6.28318530717959 / float(size.x));
    return vec4(elevation.y * azimuth.y, elevation.y * azimuth.x, elevation.x, solidAngle);
}
