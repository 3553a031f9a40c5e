"""Tables that the page needs for lights and gloss, as EXR files: of lobes' albedo, and of profiles."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from srbf.asset import Asset
from srbf.errors import InputError
from srbf.io.image import float_exr
from srbf.light_profile import Profile
from srbf.microfacets import albedo_table

LOBE_ALBEDO = "lobe_albedo.exr"


def lobe_albedo() -> bytes:
    """The table of `glsl/gloss/lobe_albedo.glsl`, its third channel 0."""
    table = albedo_table()
    return float_exr(np.concatenate([table, np.zeros_like(table[:, :, :1])], axis=2))


def profile_files(asset: Asset, given: Sequence[Profile] = ()) -> dict[str, tuple[bool, Callable[[], bytes]]]:
    """Whether a profile is an image, and what makes its table, by the name that lights have for it.

    Those of the IES files of an asset's own lights, one channel, then those `given` as files; InputError where one has the name of another.
    """
    texts: dict[str, str] = asset.manifest.get("scene_profiles", {})
    found: dict[str, tuple[bool, Callable[[], bytes]]] = {name: (False, partial(_of_ies, text, name)) for name, text in texts.items()}
    for profile in given:
        name = name_of(profile)
        if name in found:
            raise InputError(f"expected profiles of different names, found two of {name}; rename the file")
        found[name] = (profile.projected, partial(float_exr, profile.table))
    return found


def name_of(profile: Profile) -> str:
    """The name of a profile's file; InputError where it has none."""
    if profile.file is None:
        raise InputError("expected a profile that was read from a file, found another")
    return profile.file[0]


def _of_ies(text: str, name: str) -> bytes:
    return float_exr(Profile.of_ies(text.encode(), name).table[:, :, :1])
