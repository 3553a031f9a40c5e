"""Tables that the page needs for lights and gloss, as EXR files: of lobes' albedo, and of profiles."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from srbf.asset import Asset
from srbf.io.image import float_exr
from srbf.light_profile import Profile
from srbf.microfacets import albedo_table

LOBE_ALBEDO = "lobe_albedo.exr"


def lobe_albedo() -> bytes:
    """The table of `glsl/gloss/lobe_albedo.glsl`, its third channel 0."""
    table = albedo_table()
    return float_exr(np.concatenate([table, np.zeros_like(table[:, :, :1])], axis=2))


def own_profiles(asset: Asset) -> dict[str, Callable[[], bytes]]:
    """What makes the table of each IES file of an asset's own lights, by the name that its lights have for it."""
    texts: dict[str, str] = asset.manifest.get("scene_profiles", {})

    def table(text: str, name: str) -> bytes:
        return profile_table(Profile.of_ies(text.encode(), name))

    return {name: partial(table, text, name) for name, text in texts.items()}


def profile_table(profile: Profile) -> bytes:
    """An EXR file: of an image RGB, of an IES file one channel."""
    return float_exr(profile.table if profile.projected else profile.table[:, :, :1])
