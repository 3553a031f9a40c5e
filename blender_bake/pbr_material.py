# SPDX-License-Identifier: GPL-3.0-or-later
"""A physically based material in glTF's terms, read from the nodes of a Blender material as the camera sees it."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any

import bpy
import numpy as np

from blender_bake.node_values import Place, color, number, source, value

GRAY = (0.8, 0.8, 0.8)  # what Cycles shows where there is no material, and Blender's own base color
IOR = 1.5
GLOSSY = {"BSDF_GLOSSY", "BSDF_ANISOTROPIC", "BSDF_METALLIC"}
GLASS = {"BSDF_GLASS", "BSDF_REFRACTION"}


@dataclass(frozen=True)
class PbrMaterial:
    """A material with constant parameters: colors linear Rec.709, roughness as in Blender and glTF (square root of the microfacets' width).

    specular: scale of a dielectric's reflection, 0 to 1. inside: attenuation color of light through a solid body, besides the base color,
    which a Glass BSDF applies at both walls. emission: radiance. varies: the base color is a guess at a network of textures; a bake of
    the diffuse albedo has its value at each point.
    """

    name: str
    base_color: tuple[float, ...] = GRAY
    metallic: float = 0.0
    roughness: float = 1.0
    specular: float = 1.0
    ior: float = IOR
    transmission: float = 0.0
    inside: tuple[float, ...] = (1.0, 1.0, 1.0)
    alpha: float = 1.0
    emission: tuple[float, ...] = (0.0, 0.0, 0.0)
    varies: bool = False

    @property
    def is_diffuse(self) -> bool:
        """Whether it has an albedo that can be baked."""
        return self.metallic < 0.5 and self.transmission < 0.5

    def record(self) -> dict[str, Any]:
        """As JSON."""
        return asdict(self)


def pbr_material_of(material: bpy.types.Material | None) -> PbrMaterial:
    """The material of a slot; of several mixed BSDFs the one with the largest share, the first of equal ones.

    A share that varies over the surface counts as one half. A transparent BSDF beside it becomes alpha; alone, it becomes a pane of
    IOR 1. Mixes by light path are those of a camera ray.
    """
    if material is None:
        return PbrMaterial("(none)", specular=0.0)
    if material.node_tree is None or not material.use_nodes:
        return PbrMaterial(material.name_full, tuple(material.diffuse_color[:3]), material.metallic, material.roughness)
    output = material.node_tree.get_output_node("CYCLES") or material.node_tree.get_output_node("ALL")
    shares = [] if output is None else _shares(Place(output.inputs["Surface"]), 1.0)
    if not shares:
        return PbrMaterial(material.name_full, (0.0, 0.0, 0.0), specular=0.0)
    found = [(share.weight, share.known, _of_shader(material.name_full, share.shader)) for share in shares]
    emitted = np.sum([weight * np.array(surface.emission) for weight, _, surface in found], axis=0)
    emission = tuple(float(c) for c in emitted)
    surfaces = [(weight, known, surface) for (weight, known, surface), share in zip(found, shares, strict=True) if share.is_surface]
    if not surfaces:
        clear = next((surface for _, _, surface in found if surface.transmission > 0), None)
        return replace(clear or PbrMaterial(material.name_full, (0.0, 0.0, 0.0), specular=0.0), emission=emission)
    weight, _, surface = max(surfaces, key=lambda surface: surface[0])
    others = [other for w, _, other in surfaces if other is not surface and w > 0 and other.is_diffuse]
    mixed = any(share.is_surface and not share.known for share in shares) and bool(others)
    clear_share = sum(
        w for (w, known, other), share in zip(found, shares, strict=True) if known and not share.is_surface and other.transmission
    )
    return replace(
        surface,
        emission=emission,
        alpha=surface.alpha * min(1.0, max(0.0, 1.0 - clear_share)),
        varies=surface.varies or (mixed and surface.is_diffuse),
    )


@dataclass(frozen=True)
class _Share:
    """A BSDF or emission (its output), its share of the surface, and whether that is constant."""

    weight: float
    known: bool
    shader: Place

    @property
    def is_surface(self) -> bool:
        return self.shader.node.type not in {"BSDF_TRANSPARENT", "EMISSION", "HOLDOUT"}


def _shares(place: Place, weight: float, known: bool = True) -> list[_Share]:
    _, output = source(place)
    if output is None or weight <= 0:
        return []
    if output.node.type == "ADD_SHADER":
        return [share for i in (0, 1) for share in _shares(Place(output.node.inputs[i], output.groups), weight, known)]
    if output.node.type != "MIX_SHADER":
        return [_Share(weight, known, output)]
    share, first, second = (Place(socket, output.groups) for socket in output.node.inputs[:3])
    factor = value(share)
    t = 0.5 if factor is None else min(max(float(factor.mean()), 0.0), 1.0)
    known = known and factor is not None
    return _shares(first, weight * (1 - t), known) + _shares(second, weight * t, known)


def _of_shader(name: str, shader: Place) -> PbrMaterial:
    kind = shader.node.type

    def socket(*names: str) -> Place | None:
        return next((place for place in map(shader.input, names) if place is not None), None)

    base = socket("Base Color", "Color")
    surface = PbrMaterial(name, _triple(color(base, GRAY)), specular=0.0, varies=base is not None and value(base) is None)
    roughness = number(socket("Roughness"), 1.0)
    if kind == "BSDF_PRINCIPLED":
        shines = color(socket("Emission Color", "Emission"), (0, 0, 0)) * number(socket("Emission Strength"), 0.0)
        return replace(
            surface,
            metallic=_unit(number(socket("Metallic"), 0.0)),
            roughness=_unit(roughness),
            specular=_unit(2 * number(socket("Specular IOR Level", "Specular"), 0.5)),
            ior=number(socket("IOR"), IOR),
            transmission=_unit(number(socket("Transmission Weight", "Transmission"), 0.0)),
            alpha=_unit(_alpha(socket("Alpha"))),
            emission=tuple(float(max(c, 0.0)) for c in shines),
        )
    if kind in GLOSSY:
        return replace(surface, metallic=1.0, roughness=_unit(roughness), specular=1.0)
    if kind in GLASS:
        surface = replace(surface, roughness=_unit(roughness), ior=number(socket("IOR"), IOR), transmission=1.0, inside=surface.base_color)
        return replace(surface, specular=1.0 if kind == "BSDF_GLASS" else 0.0)
    if kind == "BSDF_TRANSPARENT":
        return replace(surface, roughness=0.0, ior=1.0, transmission=1.0)
    if kind == "EMISSION":
        shines = color(base, GRAY) * number(socket("Strength"), 1.0)
        return replace(surface, base_color=(0.0, 0.0, 0.0), emission=tuple(float(max(c, 0.0)) for c in shines), varies=False)
    return surface


def _alpha(place: Place | None) -> float:
    """The alpha; 1 where it varies, since a glTF factor is constant."""
    found = value(place)
    return 1.0 if found is None else float(found.mean())


def _unit(number: float) -> float:
    return min(max(number, 0.0), 1.0)


def _triple(rgb: np.ndarray) -> tuple[float, ...]:
    return tuple(float(c) for c in np.clip(rgb, 0.0, 1.0))
