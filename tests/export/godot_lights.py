"""Godot's lights for scripts/test_godot.py: as properties of nodes, and what they mean by the engine's documentation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.io.image import decode_srgb
from srbf.lights import DirectionalLight, Falloff, Light, PointLight, SpotLight

RANGE = 20.0  # meters: where Godot's own omni and spot lights end
Z_UP = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]], np.float64)  # Godot's (x, y, z) to (x, -z, y)
COLOR = (0.9, 0.5, 0.7)  # as Godot's inspector shows it: sRGB
STRAIGHT = np.eye(4)
ASKEW = np.array([[0, 0, 1.25, 0.3], [1.25, 0, 0, -0.1], [0, 1.25, 0, 0.2], [0, 0, 0, 1]], np.float64)  # turned, scaled and moved
TIPPED = np.array([[0.6, -0.8, 0, 0], [0.8, 0.6, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])  # its horizon differs from the environment's
PLACE = np.array([0.4, 1.3, -0.2])
TOWARDS = np.array([0.3, 0.8, 0.4]) / np.linalg.norm([0.3, 0.8, 0.4])


@dataclass(frozen=True)
class Lit:
    """A light as the properties of a Godot node, and its documented meaning in Godot's frame."""

    node: dict[str, Any]
    direction: ndarray
    position: ndarray
    energy: float
    decay: float = 1.0
    spot: tuple[float, float] | None = None  # half-angle (rad), spot_angle_attenuation
    color: tuple[float, float, float] = COLOR

    @property
    def direction_z_up(self) -> ndarray:
        """Towards a distant light, against where a spot shines, in srbf's world."""
        return np.asarray(Z_UP[:3, :3] @ self.direction)

    def light(self) -> Light:
        """The same light in srbf, in the world frame, z up."""
        color = tuple((np.pi * self.energy * decode_srgb(np.array(self.color))).tolist())
        towards, place = self.direction_z_up, tuple(Z_UP[:3, :3] @ self.position)
        falloff: Falloff = "inverse-square" if self.decay >= 1.5 else "linear"
        if self.node["kind"] == "DirectionalLight3D":
            return DirectionalLight(tuple(towards), color)
        if self.spot is None:
            return PointLight(place, color, falloff=falloff)
        outer, exponent = self.spot
        share = max(0.0, 2 * 0.5**exponent - 1)
        inner = float(np.arccos(1 - share * (1 - np.cos(outer))))
        return SpotLight(place, color, falloff=falloff, direction=tuple(-towards), inner=inner, outer=outer)


def node(
    kind: str,
    energy: float,
    place: ndarray = PLACE,
    towards: ndarray = TOWARDS,
    color: tuple[float, float, float] = COLOR,
    **properties: float,
) -> dict[str, Any]:
    across = np.cross([0.3, 1.0, 0.2], towards)
    across /= np.linalg.norm(across)
    frame = np.eye(4)
    frame[:3] = np.stack([across, np.cross(towards, across), towards, place], axis=1)
    numbers = {name: repr(float(value)) for name, value in {"light_energy": energy, **properties}.items()}
    return {"kind": kind, "transform": transform(frame), "light_color": "Color({}, {}, {}, 1)".format(*color), **numbers}


def transform(matrix: ndarray) -> str:
    return "Transform3D({})".format(", ".join(repr(float(v)) for v in [*matrix[:3, :3].ravel(), *matrix[:3, 3]]))


SUN = Lit(node("DirectionalLight3D", 0.3), TOWARDS, PLACE, 0.3)
OMNI = Lit(node("OmniLight3D", 0.5, omni_range=RANGE), TOWARDS, PLACE, 0.5)
SQUARED = Lit(node("OmniLight3D", 0.4, omni_range=RANGE, omni_attenuation=2), TOWARDS, PLACE, 0.4, 2.0)
SPOT = Lit(
    node("SpotLight3D", 0.7, spot_range=RANGE, spot_angle=50, spot_attenuation=2, spot_angle_attenuation=0.5),
    TOWARDS,
    PLACE,
    0.7,
    2.0,
    (np.radians(50), 0.5),
)
LIGHTS = {
    "directional": [SUN],
    "point": [OMNI],
    "squared": [SQUARED],
    "spot": [SPOT],
    "all": [SUN, OMNI, SPOT],
    "by table": [SUN],
    "environment": [SUN],
    "mix": [SUN],
    "inside": [SQUARED, SPOT],
}
MIX: dict[str, tuple[float, tuple[float, float, float]]] = {  # name: intensity, color as Godot's inspector shows it; the rest is 1
    "Desk": (0.5, (1.0, 0.6, 0.9)),
    "TV": (0.0, (1.0, 1.0, 1.0)),
    'L\'été, "x"': (2.0, (0.4, 0.8, 0.7)),
}
