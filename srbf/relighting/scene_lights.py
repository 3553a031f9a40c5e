"""The lights of the scene that a deep framebuffer was baked from, as the asset lists them."""

from __future__ import annotations

import functools
from dataclasses import replace
from typing import Any

from srbf.asset import MANIFEST, Asset
from srbf.errors import InputError
from srbf.light_entries import Profiles, lights_of
from srbf.light_linking import choices_of
from srbf.light_profile import Profile
from srbf.lights import Light
from srbf.methods.linked_objects import known_objects

SHOWN = 8  # names in a line


def scene_lights(asset: Asset) -> dict[str, Light]:
    """The scene's own lights by name, without its world and what emits.

    Parameters
    ----------
    asset
        Of a bake with `light_set=gather`.

    Returns
    -------
    dict
        Lights in the units of `srbf.lights`, in order of name.

    Raises
    ------
    InputError
        Where the asset lists none, or the profile of one is damaged.

    Examples
    --------
    >>> scene_lights(asset)
    Traceback (most recent call last):
    srbf.errors.InputError: expected an asset that lists its scene's lights, found none; ...
    """
    listed = asset.manifest.get("scene_lights", [])
    if not listed:
        raise InputError("expected an asset that lists its scene's lights, found none; bake a scene with lights with `light_set=gather`")
    lights = lights_of([one["light"] for one in listed], f"the scene's lights in {MANIFEST}", profiles=profiles_of(asset))
    known = known_objects(asset)
    return {one["name"]: _within(light, known) for one, light in zip(listed, lights, strict=True)}


def profiles_of(asset: Asset) -> Profiles:
    """The profile of a name that the scene's own lights have for it; InputError for other names, and for a damaged file."""
    texts: dict[str, str] = asset.manifest.get("scene_profiles", {})

    @functools.cache
    def profile(name: str) -> Profile:
        if name not in texts:
            raise InputError(f"expected a profile of the asset's scene ({', '.join(texts) or 'which has none'}), found {name!r}")
        return Profile.of_ies(texts[name].encode(), name)

    return profile


def _within(light: Light, known: list[str]) -> Light:
    """A light that chooses among known objects alone: others neither receive light nor shadow it."""
    chosen: Any = light
    return replace(chosen, **{link: choice.within(known) for link, choice in choices_of(light).items()}) if known else light


def lines_of(asset: Asset) -> list[str]:
    """What the scene has that its lights in the asset lack: a line for each light left out, or without one of its properties."""
    notes = [f"light {one['name']!r}: {one['note']}" for one in asset.manifest.get("scene_lights", []) if "note" in one]
    left = [f"light {one['name']!r} is left out: {one['reason']}" for one in asset.manifest.get("scene_lights_left_out", [])]
    lines = notes + left
    return lines if len(lines) <= SHOWN else [*lines[:SHOWN], f"{len(lines) - SHOWN} more in the asset's {MANIFEST}"]
