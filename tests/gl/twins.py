"""What the twin tests share: the registry of shader functions, and inputs as the shaders take them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from srbf.gl.uniforms import point_light_uniforms
from srbf.lights import PointLight, SpotLight
from srbf.sphere import normalize

EPS = 2.0**-23  # one step of a float32 near 1
UNIT = 4 * EPS  # a few roundings of numbers near 1
SUM = 1e-5  # the contract, of sum |c_i R_i|

N = 97
M = 64  # texels per row of planes: their centers are exact in float32
K = 5
SPOT = SpotLight((0.3, 0.2, 0.9), (0.5, 1.0, 2.0), a0=0.8, direction=(0.1, 0.2, -1.0), inner=0.3, outer=0.7, falloff="inverse-square")
POINT = PointLight((0.3, 0.2, 0.9), (0.5, 1.0, 2.0), a0=0.8, radius=0.7)

Evaluate = Callable[..., np.ndarray]
Twin = Callable[..., None]
TWINS: dict[str, Twin] = {}


def twin(file: str) -> Callable[[Twin], Twin]:
    def register(test: Twin) -> Twin:
        TWINS[file] = test
        return test

    return register


def vec4(*columns: Any) -> np.ndarray:
    """(N, 4) float32 from columns of one or three, zero at the end."""
    out = np.column_stack(columns).astype(np.float32)
    return np.pad(out, ((0, 0), (0, 4 - out.shape[1])))


def units(n: int, seed: int) -> np.ndarray:
    """Unit vectors, (n, 3), rounded to float32 as the shader sees them."""
    return normalize(np.random.default_rng(seed).normal(size=(n, 3))).astype(np.float32)


def point_light_expression(light: PointLight) -> str:
    """SrbfPointLight(...) with the members in the struct's order."""
    u = point_light_uniforms(light)
    names = ("position", "positionLow", "color", "axis", "a0", "radius", "versineInner", "versineOuter", "falloff")
    members = [f"vec3({', '.join(map(repr, map(float, u[name])))})" for name in names[:4]]
    members += [repr(float(u[name])) for name in names[4:8]] + [str(u["falloff"])]
    return f"SrbfPointLight({', '.join(members)})"
