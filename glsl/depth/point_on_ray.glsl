// SPDX-License-Identifier: MIT
/* srbfPointOnRay: P = E - d V / |V|, the point that an eye sees at a distance.
   use:    vec3 srbfPointOnRay(vec3 eye, vec3 toEye, float rayLength)
   domain: meters, one frame; toEye = V from the point to the eye, of any length but 0; rayLength = d from srbfRayLength, never the
           depth along the view axis
   twin:   srbf.gl.depth_buffer.point_on_ray
   cite:   Wong2005, "Point-Source Shader" */
vec3 srbfPointOnRay(vec3 eye, vec3 toEye, float rayLength) {
    return eye - rayLength * (toEye / length(toEye));
}
