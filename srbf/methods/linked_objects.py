"""The objects of an asset's scene, by whose names lights choose what they shine on."""

from __future__ import annotations

import functools
from collections.abc import Sequence

from srbf.asset import Asset
from srbf.errors import InputError
from srbf.io.scene_glb import read_triangles
from srbf.light_linking import choices_of, require_names
from srbf.lights import Light


def require_objects(asset: Asset, lights: Sequence[Light]) -> None:
    """InputError where a light names an object that the asset's scene lacks, or chooses objects and the bake kept none."""
    if not any(choices_of(light) for light in lights):
        return
    known = known_objects(asset)
    if not known:
        raise InputError(
            "expected an asset that knows its objects for a light with `receivers` or `blockers`, found one of an older bake; "
            "bake again, and fit"
        )
    require_names(lights, known)


def known_objects(asset: Asset) -> list[str]:
    """The names by which lights may choose objects; none where the bake kept none of surfels."""
    names = asset.manifest.get("gather", {}).get("objects", [])
    return [*names, *_names_of(asset.required_scene())] if names else []


@functools.lru_cache(maxsize=4)
def _names_of(scene: bytes) -> tuple[str, ...]:
    return read_triangles(scene).names
