// SPDX-License-Identifier: MIT
/* srbfDecode: one texel of a relighting map as it was fitted: value = stored * scale + bias.
   use:    vec3 srbfDecode(vec3 stored, vec3 scale, vec3 bias)
   domain: stored as the texture unit returns it (8-bit maps as byte / 255); scale, bias of this map, from asset.json;
           SRBF_PLAIN: all scales are 1 and biases 0
   twin:   srbf.asset.Asset.coefficients
   cite:   Wong2005, "Directional-Source Shader" */
vec3 srbfDecode(vec3 stored, vec3 scale, vec3 bias) {
#ifdef SRBF_PLAIN
    return stored;  // all scales 1, all biases 0: floats need no decoding
#else
    return stored * scale + bias;
#endif
}
