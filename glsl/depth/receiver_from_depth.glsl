// SPDX-License-Identifier: MIT
/* srbfReceiverFromDepth: the world position that a camera sees at a place of its picture, out of its depth buffer.
   use:    vec3 srbfReceiverFromDepth(float stored, vec2 place, SrbfCamera camera)
   domain: stored in [0, 1], as the depth buffer holds it; place from (-1, -1), the picture's lower left corner, to (1, 1)
   twin:   srbf.gl.depth_buffer.receivers
   cite:   Wong2005, "Point-Source Shader" */
#include "depth/eye_depth.glsl"
#include "depth/point_on_ray.glsl"
#include "depth/ray_length.glsl"

struct SrbfCamera {
    vec3 eye;            // meters, in the asset's frame
    vec3 forward;        // the view axis, unit
    vec3 center;         // from the eye to the picture's middle: 1 m ahead, or, orthographic, sideways alone
    vec3 across;         // from there to the middle of the picture's right edge
    vec3 up;             // and of its upper edge
    vec4 depthTerms;     // of srbfEyeDepth
    float orthographic;  // 1, or 0 in perspective
};

vec3 srbfReceiverFromDepth(float stored, vec2 place, SrbfCamera camera) {
    vec3 sideways = camera.center + place.x * camera.across + place.y * camera.up;
    vec3 eye = camera.eye + camera.orthographic * sideways;
    vec3 toEye = camera.orthographic > 0.5 ? -camera.forward : -sideways;
    return srbfPointOnRay(eye, toEye, srbfRayLength(srbfEyeDepth(stored, camera.depthTerms), toEye, camera.forward));
}
