"""What the shaders' uniforms hold: vec4-padded arrays, and a point light split into single-precision parts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32
from srbf.gl.context import Limits
from srbf.gl.depth_buffer import DepthCamera
from srbf.light_profile import axes_of
from srbf.lights import PointLight, SpotLight

FALLOFF = {"linear": 0, "inverse-square": 1}  # SRBF_FALLOFF_LINEAR, SRBF_FALLOFF_INVERSE_SQUARE
VECTORS_KEPT_FREE = 32  # vec4 for the point light and for drivers
VECTORS_PER_POINT_LIGHT = 4
MOST_POINT_LIGHTS = 16  # per pass
NO_CONE = (3.0, 4.0)  # versines above every angle: the cone of a point light is 1 everywhere


def padded(triples: Float[ndarray, "K 3"]) -> Float32[ndarray, "K 4"]:
    """Triples as vec4, w = 0: arrays of vec3 differ in stride between APIs, arrays of vec4 do not."""
    out = np.zeros((len(triples), 4), np.float32)
    out[:, :3] = triples
    return out


def point_light_uniforms(light: PointLight) -> dict[str, Any]:
    """Members of the shader's SrbfPointLight for a point or spot light that is already in the asset's frame."""
    position = np.array(light.position, np.float64)
    high = position.astype(np.float32)
    low = (position - high).astype(np.float32)
    axis = (0.0, 0.0, 1.0) if light.profile is None else light.direction
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


def profile_uniforms(light: PointLight) -> dict[str, Any]:
    """What the shaders know of a light's profile beside its texture: whether it has one, its frame, and what is projected how far."""
    x, y, _ = axes_of(light.direction, light.roll)
    tangent = light.tangent if light.profile is not None and light.profile.projected else 0.0
    return {
        "profiled": light.profile is not None,
        "profileAcross": tuple(x.tolist()),
        "profileUp": tuple(y.tolist()),
        "profileTangent": tangent,
    }


def vectors_free(limits: Limits) -> int:
    """vec4 uniforms that a pass may fill with arrays."""
    return limits.fragment_vectors - VECTORS_KEPT_FREE


def point_lights_per_pass(free: int, vectors_per_layer: int) -> int:
    """How many point lights a pass takes: a power of two that leaves half of the `free` uniforms to layers, where that many are needed."""
    point_lights = MOST_POINT_LIGHTS
    while point_lights > 1 and VECTORS_PER_POINT_LIGHT * point_lights > max(free // 2, free - 32 * vectors_per_layer):
        point_lights //= 2
    return point_lights


def point_light_groups(point_lights: Sequence[PointLight], most: int) -> Iterator[tuple[Sequence[PointLight], int]]:
    """(point lights of a pass, places in its array) of at most `most`; places are powers of two, so that few programs serve any number."""
    for first in range(0, len(point_lights), most):
        group = point_lights[first : first + most]
        yield group, 1 << (len(group) - 1).bit_length()


def packed_point_lights(point_lights: Sequence[PointLight], count: int) -> Float32[ndarray, "rows 4"]:
    """Point and spot lights, already in the asset's frame, four vec4 each; zeros up to `count` lights (4 count rows).

    They hold (position, radius), (positionLow, falloff), (color, versineInner), (axis, versineOuter); the color is the irradiance
    at 1 m, so that a0 need not be stored.
    """
    rows = np.zeros((count, 4, 4), np.float32)
    for row, light in zip(rows, point_lights, strict=False):
        u = point_light_uniforms(light)
        at_one = light.a0 if light.falloff == "linear" else light.a0**2
        row[0] = *u["position"], u["radius"]
        row[1] = *u["positionLow"], u["falloff"]
        row[2] = *(at_one * component for component in light.color), u["versineInner"]
        row[3] = *u["axis"], u["versineOuter"]
    return rows.reshape(-1, 4)


def camera_uniforms(camera: DepthCamera) -> dict[str, Any]:
    """Members of the shader's SrbfCamera."""
    vectors = {name: getattr(camera, name) for name in ("eye", "forward", "center", "across", "up")}
    return {
        **{name: tuple(vector.tolist()) for name, vector in vectors.items()},
        "depthTerms": tuple(camera.depth_terms.tolist()),
        "orthographic": float(camera.orthographic),
    }


def versine(angle: float) -> float:
    """1 - cos of an angle (rad), precise for small ones."""
    return float(2 * np.sin(angle / 2) ** 2)
