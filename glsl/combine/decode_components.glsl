// SPDX-License-Identifier: MIT
/* srbfDecodeComponents: four components of a texel as they were fitted: value = stored * scale + bias.
   use:    vec4 srbfDecodeComponents(vec4 stored, vec4 scale, vec4 bias)
   domain: stored as the texture unit returns it (8-bit layers as byte / 255); scale, bias of this layer, from asset.json;
           channels past the last component have scale 0 and bias 0, and come out as 0; SRBF_PLAIN: all scales are 1
           and biases 0, and those channels are stored as 0
   twin:   srbf.asset.Asset.coefficients
   cite:   - */
vec4 srbfDecodeComponents(vec4 stored, vec4 scale, vec4 bias) {
#ifdef SRBF_PLAIN
    return stored;  // all scales 1, all biases 0: floats need no decoding
#else
    return stored * scale + bias;
#endif
}
