"""What the shaders' uniforms hold: vec4-padded arrays, and a lamp split into single-precision parts."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32
from srbf.lights import PointLight, SpotLight

FALLOFF = {"linear": 0, "inverse-square": 1}  # SRBF_FALLOFF_LINEAR, SRBF_FALLOFF_INVERSE_SQUARE
VECTORS_KEPT_FREE = 32  # vec4 for the lamp and what drivers take for themselves
NO_CONE = (3.0, 4.0)  # versines past every angle: the cone of a point light is 1 everywhere


def padded(triples: Float[ndarray, "K 3"]) -> Float32[ndarray, "K 4"]:
    """Triples as vec4, w = 0: arrays of vec3 differ in stride between APIs, arrays of vec4 do not."""
    out = np.zeros((len(triples), 4), np.float32)
    out[:, :3] = triples
    return out


def lamp_uniforms(light: PointLight) -> dict[str, Any]:
    """Members of the shader's SrbfLamp for a point or spot light that is already in the asset's frame."""
    position = np.array(light.position, np.float64)
    high = position.astype(np.float32)
    low = (position - high).astype(np.float32)
    axis = (0.0, 0.0, 1.0)
    inner, outer = NO_CONE
    if isinstance(light, SpotLight):
        axis = light.direction
        inner, outer = versine(light.inner), versine(light.outer)
    return {
        "position": tuple(high.tolist()),
        "positionLow": tuple(low.tolist()),
        "color": light.color,
        "axis": axis,
        "a0": light.a0,
        "radius": light.radius,
        "versineInner": inner,
        "versineOuter": outer,
        "falloff": FALLOFF[light.falloff],
    }


def versine(angle: float) -> float:
    """1 - cos of an angle (rad), precise for small ones."""
    return float(2 * np.sin(angle / 2) ** 2)
