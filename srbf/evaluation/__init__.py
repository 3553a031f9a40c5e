"""Errors of an asset: by role and by light, leave-one-out, by bytes, in motion, across cluster borders."""
