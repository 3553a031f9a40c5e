"""Direct diffuse light for indirect assets: N.L times visibility times the light, by rays or by a shadow map."""
