// SPDX-License-Identifier: MIT
/* srbfRayLength: the distance from the eye of what lies at a depth along the view axis: depth over the cosine between ray and axis.
   use:    float srbfRayLength(float eyeDepth, vec3 toEye, vec3 forward)
   domain: eyeDepth from srbfEyeDepth; toEye of any length but 0, in front of the camera (toEye . forward < 0); forward unit; in an
           orthographic view toEye is -forward, and the two are the same
   twin:   srbf.gl.depth_buffer.ray_length
   cite:   Wong2005, "Point-Source Shader" */
float srbfRayLength(float eyeDepth, vec3 toEye, vec3 forward) {
    return eyeDepth * length(toEye) / -dot(toEye, forward);
}
