// SPDX-License-Identifier: MIT
/* srbfEnvironmentTexel: where a texel of an equirectangular map is (.xyz, unit) and the solid angle that it fills (.w, sr).
   use:    vec4 srbfEnvironmentTexel(ivec2 texel, ivec2 size, bool cut)
   domain: u = 1/2 - atan2(y, x) / 2 pi, row 0 towards +z; cut: what is below the map's own horizon has solid angle 0, and a row that
           straddles it is cut there, its centre the middle of what is left
   twin:   srbf.lights.environment_samples
   cite:   - */
vec4 srbfEnvironmentTexel(ivec2 texel, ivec2 size, bool cut) {
    float step = 3.14159265358979 / float(size.y);
    float lowest = cut ? 0.0 : -1.57079632679490;
    float top = max(step * (0.5 * float(size.y) - float(texel.y)), lowest);
    float bottom = max(step * (0.5 * float(size.y) - float(texel.y + 1)), lowest);
    float elevation = 0.5 * (top + bottom);
    float azimuth = 6.28318530717959 * (0.5 - (float(texel.x) + 0.5) / float(size.x));
    float around = cos(elevation);
    // sin a - sin b without taking one number near 1 from another
    float solidAngle = 2.0 * around * sin(0.5 * (top - bottom)) * (6.28318530717959 / float(size.x));
    return vec4(around * cos(azimuth), around * sin(azimuth), sin(elevation), solidAngle);
}
