"""The direct diffuse light that an indirect asset leaves out: N.L times visibility times the light, by rays or by a shadow map."""
