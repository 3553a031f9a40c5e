// SPDX-License-Identifier: MIT
/* srbfEyeDepth: how far along the view axis a sample of a depth buffer lies, meters.
   use:    float srbfEyeDepth(float stored, vec4 terms)
   domain: stored in [0, 1], as the depth buffer holds it; terms from the projection matrix (srbf.gl.depth_buffer.depth_terms):
           perspective or orthographic, reversed or not, far plane at infinity or not, clip z from -1 or from 0. At most 1e9, for what is
           never reached
   twin:   srbf.gl.depth_buffer.eye_depth
   cite:   - */
float srbfEyeDepth(float stored, vec4 terms) {
    float above = abs(terms.x + terms.y * stored);
    float below = abs(terms.z + terms.w * stored);
    return above < below * 1e9 ? above / below : 1e9;
}
