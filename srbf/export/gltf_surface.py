"""A look that Blender's worker has read from a material, as a physically based material of glTF 2.0 and its Khronos extensions."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32

CLOSED = 1e-3  # of the area: a surface whose area vectors sum to more than this has a hole
SHORTEST = 1e-6  # m: thinner bodies are walls
DIGITS = 6


def surface(look: dict[str, Any], thickness: float = 0.0, picture: dict[str, int] | None = None, colored: bool = False) -> dict[str, Any]:
    """The material; `look` as in `blender_bake.pbr_material.PbrMaterial`.

    thickness: of a solid body, m (see `mean_thickness`), seen from outside only; 0 is a thin wall without refraction
    picture: glTF's texture info of its base color; colored: the vertices hold it. Either makes the base color itself white.
    """
    base = [1.0, 1.0, 1.0] if colored or picture is not None else look["base_color"]
    solid = look["transmission"] > 0 and thickness > 0
    material: dict[str, Any] = {
        "name": look["name"],
        "doubleSided": not solid,
        "pbrMetallicRoughness": {
            "baseColorFactor": _rounded([*base, look["alpha"]]),
            **({"baseColorTexture": picture} if picture is not None else {}),
            "metallicFactor": _rounded(look["metallic"]),
            "roughnessFactor": _rounded(look["roughness"]),
        },
    }
    if look["alpha"] < 1:
        material["alphaMode"] = "BLEND"
    strength = max(look["emission"])
    extensions: dict[str, dict[str, Any]] = {}
    if strength > 0:
        material["emissiveFactor"] = _rounded([c / max(strength, 1.0) for c in look["emission"]])
    if strength > 1:
        extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": _rounded(strength)}
    if look["specular"] < 1:
        extensions["KHR_materials_specular"] = {"specularFactor": _rounded(look["specular"])}
    if look["transmission"] > 0:
        extensions["KHR_materials_transmission"] = {"transmissionFactor": _rounded(look["transmission"])}
    if look["transmission"] > 0 or abs(look["ior"] - 1.5) > 1e-3:
        extensions["KHR_materials_ior"] = {"ior": _rounded(max(look["ior"], 1.0))}
    if solid:
        volume: dict[str, Any] = {"thicknessFactor": _rounded(thickness)}
        if min(look["inside"]) < 1:
            volume |= {"attenuationColor": _rounded(look["inside"]), "attenuationDistance": volume["thicknessFactor"]}
        extensions["KHR_materials_volume"] = volume
    if extensions:
        material["extensions"] = extensions
    return material


def mean_thickness(corners: Float32[ndarray, "T 3 3"]) -> float:
    """4 V / A of a body's triangles, meters: the mean length of the straight ways through it, if it is convex (Cauchy's theorem).

    A ball of radius r has 4r/3, a torus the width of its tube, a thin plate twice its height. 0 where the surface has a hole, and so no
    inside, or is inside out.
    """
    points = corners.astype(np.float64) - corners.reshape(-1, 3).mean(axis=0, dtype=np.float64)
    a, b, c = points[:, 0], points[:, 1], points[:, 2]
    vectors = np.cross(b - a, c - a) / 2
    area = float(np.linalg.norm(vectors, axis=1).sum())
    if area <= 0 or float(np.linalg.norm(vectors.sum(axis=0))) > CLOSED * area:
        return 0.0
    volume = float((a * np.cross(b, c)).sum()) / 6
    thickness = 4 * volume / area
    return thickness if thickness > SHORTEST else 0.0


def _rounded(value: Any) -> Any:
    return [round(float(v), DIGITS) for v in value] if isinstance(value, (list, tuple)) else round(float(value), DIGITS)
