// SPDX-License-Identifier: MIT
/* srbfMipLevel: the level of a mip map whose texels are as large as a pixel: computed once per pixel, since loops may take no derivatives.
   use:    float srbfMipLevel(vec2 texelsAcross, vec2 texelsDown)
   domain: dFdx and dFdy of uv times the texture's size; result at least 0
   twin:   numpy.log2
   cite:   OpenGL 3.3 specification, section 3.8.11 */
float srbfMipLevel(vec2 texelsAcross, vec2 texelsDown) {
    float squared = max(dot(texelsAcross, texelsAcross), dot(texelsDown, texelsDown));
    return 0.5 * log2(max(squared, 1.0));
}
