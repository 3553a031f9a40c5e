"""Looks as materials of glTF, and how thick a body of glass is."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from srbf.export.gltf_surface import mean_thickness, surface

CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float32)
SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
PLAIN: dict[str, Any] = {
    "name": "plain",
    "base_color": [0.5, 0.25, 0.125],
    "metallic": 0.0,
    "roughness": 0.5,
    "specular": 1.0,
    "ior": 1.5,
    "transmission": 0.0,
    "inside": [1.0, 1.0, 1.0],
    "alpha": 1.0,
    "emission": [0.0, 0.0, 0.0],
}


def box(size: tuple[float, float, float], sides: int = 6) -> np.ndarray:
    """(2 sides, 3, 3) triangles far from the origin, turned outwards."""
    places = CUBE * np.float32(size) + np.float32([5, -7, 3])
    return np.array([places[list(t)] for a, b, c, d in SIDES[:sides] for t in ((a, b, c), (a, c, d))])


def tube(major: float, minor: float, around: int = 96, across: int = 48) -> np.ndarray:
    """Triangles of a torus, or with no `major` of a ball, turned outwards."""
    turns = 2 * np.pi * np.arange(around + 1) / around
    angles = np.linspace(-np.pi / 2, np.pi / 2, across + 1) if major == 0 else 2 * np.pi * np.arange(across + 1) / across
    a, b = np.meshgrid(turns, angles, indexing="ij")
    radius = major + minor * np.cos(b)
    places = np.stack([radius * np.cos(a), radius * np.sin(a), minor * np.sin(b)], axis=2).astype(np.float32)
    p, q, r, s = places[:-1, :-1], places[1:, :-1], places[1:, 1:], places[:-1, 1:]
    return np.concatenate([np.stack(t, axis=2).reshape(-1, 3, 3) for t in ((p, q, r), (p, r, s))])


@pytest.mark.parametrize(
    ("triangles", "expected"),
    [
        (box((0.4, 0.4, 0.4)), 0.4 * 2 / 3),
        (box((50, 50, 0.01)), 0.02),
        (tube(0, 0.2), 0.2 * 4 / 3),
        (tube(0.3, 0.075), 0.15),
        (np.concatenate([tube(0, 0.2), tube(0, 0.2) + np.float32(9)]), 0.2 * 4 / 3),
    ],
    ids=["cube", "plate", "ball", "torus", "two balls"],
)
def test_a_body_is_as_thick_as_the_mean_way_through_it(triangles: np.ndarray, expected: float) -> None:
    assert mean_thickness(triangles) == pytest.approx(expected, rel=0.01)


def test_what_has_no_inside_has_no_thickness() -> None:
    assert mean_thickness(box((1, 1, 1), sides=5)) == 0
    assert mean_thickness(box((1, 1, 1))[:2]) == 0
    assert mean_thickness(box((1, 1, 1))[:, ::-1]) == 0  # inside out
    assert mean_thickness(np.zeros((4, 3, 3), np.float32)) == 0


def test_plain_surfaces_need_no_extension() -> None:
    assert surface(PLAIN, thickness=0.3) == {
        "name": "plain",
        "doubleSided": True,
        "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 0.125, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.5},
    }
    white = surface(PLAIN, colored=True)["pbrMetallicRoughness"]
    assert white["baseColorFactor"] == [1, 1, 1, 1]
    pictured = surface(PLAIN, picture={"index": 2, "texCoord": 1})["pbrMetallicRoughness"]
    assert (pictured["baseColorFactor"], pictured["baseColorTexture"]) == ([1, 1, 1, 1], {"index": 2, "texCoord": 1})


def test_glass_is_solid_or_a_thin_wall() -> None:
    glass = {**PLAIN, "transmission": 1.0, "ior": 1.33, "inside": [0.5, 0.25, 0.125]}
    solid, wall = surface(glass, thickness=0.3), surface(glass)
    assert (solid["doubleSided"], wall["doubleSided"]) == (False, True)
    assert solid["extensions"]["KHR_materials_volume"] == {
        "thicknessFactor": 0.3,
        "attenuationColor": [0.5, 0.25, 0.125],  # after the base color once, as at the second wall
        "attenuationDistance": 0.3,
    }
    assert wall["extensions"] == {"KHR_materials_transmission": {"transmissionFactor": 1.0}, "KHR_materials_ior": {"ior": 1.33}}


def test_light_of_its_own_specular_and_alpha() -> None:
    shining = surface({**PLAIN, "emission": [8.0, 4.0, 0.0], "specular": 0.0, "alpha": 0.25})
    assert shining["emissiveFactor"] == [1.0, 0.5, 0.0]
    assert shining["extensions"] == {
        "KHR_materials_emissive_strength": {"emissiveStrength": 8.0},
        "KHR_materials_specular": {"specularFactor": 0.0},
    }
    assert (shining["alphaMode"], shining["pbrMetallicRoughness"]["baseColorFactor"][3]) == ("BLEND", 0.25)
    assert surface({**PLAIN, "emission": [0.5, 0.0, 0.0]})["emissiveFactor"] == [0.5, 0.0, 0.0]
