"""Tables that the page needs for lights and gloss, as EXR files: of lobes' albedo, and of the profiles of a scene's own lights."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from numpy import ndarray

from srbf.asset import Asset
from srbf.io.image import write_image
from srbf.light_profile import Profile
from srbf.microfacets import albedo_table

LOBE_ALBEDO = "lobe_albedo.exr"


def lobe_albedo() -> bytes:
    """The table of `glsl/gloss/lobe_albedo.glsl`, its third channel 0."""
    table = albedo_table()
    return exr_of(np.concatenate([table, np.zeros_like(table[:, :, :1])], axis=2))


def profiles_of(asset: Asset) -> dict[str, Callable[[], bytes]]:
    """What makes the table of each IES file of an asset's own lights, one channel, by the name that its lights have for it."""
    texts: dict[str, str] = asset.manifest.get("scene_profiles", {})
    return {name: partial(_profile, text, name) for name, text in texts.items()}


def exr_of(pixels: ndarray) -> bytes:
    """(H, W, C) as the bytes of a float EXR."""
    with tempfile.TemporaryDirectory(prefix="srbf-") as folder:
        path = Path(folder) / "table.exr"
        write_image(path, pixels, "float")
        return path.read_bytes()


def _profile(text: str, name: str) -> bytes:
    return exr_of(Profile.of_ies(text.encode(), name).table[:, :, :1])
