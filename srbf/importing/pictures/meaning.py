"""Stored values to linear Rec.709, by the tags of the file, else by the given transfer."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32
from srbf.importing.pictures.color import SRGB_TOLERANCE, by_profile, character, from_lab, model_of, name_of, to_rec709
from srbf.importing.pictures.found import Found, Tags
from srbf.io.image import decode_srgb

Transfer = Literal["srgb", "linear"]
GAMMA_TOLERANCE = 0.01


def linear(found: Found, transfer: Transfer) -> tuple[Float32[ndarray, "H W 3"], list[str]]:
    """Linear Rec.709 values, and notes on the conversions.

    With `srgb`, a file's profile or tags win. `linear` fixes the curve: stored values stay unchanged if the file has another curve, and
    the file's primaries apply if it has a linear curve or none. Lab and inks are always converted.
    """
    pixels, tags = found.pixels, found.tags
    if found.model == "lab":
        return from_lab(pixels), ["converted {} from CIE Lab to linear Rec.709"]
    notes: list[str] = []
    if tags.profile is not None:
        converted, notes = _by_profile(found, tags.profile, transfer)
        if converted is not None:
            return converted, notes
        tags = Tags()
    if found.model == "cmyk":
        notes.append("converted {} from CMYK without a usable profile by the share of paper left")
        pixels = (1 - pixels[:, :, :3]) * (1 - pixels[:, :, 3:])
    if pixels.shape[2] == 1:
        pixels = np.repeat(pixels, 3, axis=2)
    converted, more = _by_tags(pixels, tags, transfer)
    return converted, notes + more


def _by_profile(found: Found, profile: bytes, transfer: Transfer) -> tuple[Float32[ndarray, "H W 3"] | None, list[str]]:
    """Converted pixels and notes; None instead of pixels if the profile does not apply."""
    pixels, model = found.pixels, model_of(profile)
    if found.model == "gray" and model == "rgb":
        pixels = np.repeat(pixels, 3, axis=2)
    elif found.model != model:
        return None, [f"could not use the color profile of {{}}, which is for other values; took them by `transfer={transfer}`"]
    name = name_of(profile)
    try:
        is_srgb, is_linear = (False, False) if model == "cmyk" else character(profile)
        if is_srgb:
            return None, []
        if transfer == "linear" and not is_linear and model != "cmyk":
            return None, [f"took the values of {{}} as linear by `transfer=linear`, and left their profile ({name}) aside"]
        return by_profile(pixels, profile, found.levels), [f"converted {{}} from {name} to linear Rec.709 by their profile"]
    except ValueError:
        return None, [f"could not read the color profile of {{}}; took their values by `transfer={transfer}`"]


def _by_tags(pixels: Float32[ndarray, "H W 3"], tags: Tags, transfer: Transfer) -> tuple[Float32[ndarray, "H W 3"], list[str]]:
    if tags.srgb:
        return _decoded(pixels, transfer), []
    own_linear = tags.gamma is not None and abs(tags.gamma - 1) < GAMMA_TOLERANCE
    own_curve = tags.curve is not None or tags.gamma is not None
    notes, matrix = [], None
    if tags.chromaticities is not None:
        try:
            matrix = to_rec709(tags.chromaticities)
        except ValueError:
            notes.append("could not use the chromaticities of {}; took them as Rec.709")
    if matrix is not None and np.abs(matrix - np.eye(3)).max() <= SRGB_TOLERANCE:
        matrix = None
    if matrix is None and not own_curve:
        return _decoded(pixels, transfer), notes
    space = tags.space or ("linear values" if own_linear else "a curve of their own" if own_curve else "primaries of their own")
    if transfer == "linear" and not own_linear and (own_curve or tags.space):
        return pixels, [*notes, f"took the values of {{}} as linear by `transfer=linear`, and left their tags ({space}) aside"]
    if transfer == "srgb" and tags.curve is not None:
        levels = np.linspace(0, 1, len(tags.curve))
        pixels = np.stack([np.interp(pixels[:, :, c], levels, tags.curve[:, c]) for c in range(3)], axis=2).astype(np.float32)
    elif transfer == "srgb" and own_curve and tags.gamma is not None:
        pixels = (np.sign(pixels) * np.abs(pixels) ** tags.gamma).astype(np.float32)
    else:
        pixels = _decoded(pixels, transfer)
    if matrix is not None:
        pixels = (pixels @ matrix.T.astype(np.float32)).astype(np.float32)
    elif own_linear and transfer == "linear":
        return pixels, notes  # as requested
    return pixels, [*notes, f"converted {{}} from {space} to linear Rec.709 by their tags"]


def _decoded(pixels: Float32[ndarray, "H W 3"], transfer: Transfer) -> Float32[ndarray, "H W 3"]:
    return decode_srgb(pixels).astype(np.float32) if transfer == "srgb" else pixels
