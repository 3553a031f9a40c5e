"""Colors of any space to linear Rec.709: ICC profiles by Little CMS, primaries by their matrix."""

from __future__ import annotations

import io
from functools import lru_cache
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32
from srbf.errors import MissingLibraryError
from srbf.importing.pictures.found import Model
from srbf.io.image import decode_srgb

REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)  # x and y of red, green, blue, white
ADOBE_RGB = (0.64, 0.33, 0.21, 0.71, 0.15, 0.06, 0.3127, 0.3290)
DISPLAY_P3 = (0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.3290)
REC2020 = (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290)
SRGB_TOLERANCE = 0.003  # linear light, less than an 8-bit step: closer profiles count as sRGB
LINEARITY_TOLERANCE = 1e-4  # of linear light; Little CMS is exact to 6e-5
MIN_TABLE_VALUES = 400_000  # in an image; tables pay off for more
RELATIVE = 1  # Little CMS's relative colorimetric intent: white stays white
_SIGNATURES: dict[bytes, Model] = {b"RGB ": "rgb", b"GRAY": "gray", b"CMYK": "cmyk"}
_BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])


def to_rec709(chromaticities: tuple[float, ...]) -> ndarray:
    """The (3, 3) matrix from linear RGB of these primaries to Rec.709's; white goes to white by Bradford's adaptation.

    ValueError if they span no colors.
    """
    ours, theirs = _xyz(REC709), _xyz(chromaticities)
    cones = (_BRADFORD @ ours.sum(axis=1)) / (_BRADFORD @ theirs.sum(axis=1))
    matrix: ndarray = np.linalg.solve(ours, np.linalg.solve(_BRADFORD, cones[:, None] * (_BRADFORD @ theirs)))
    if not np.isfinite(matrix).all():
        raise ValueError("chromaticities without a matrix")
    return matrix


def _xyz(chromaticities: tuple[float, ...]) -> ndarray:
    """XYZ of red, green and blue, as columns, whose sum is the white of luminance 1."""
    xy = np.asarray(chromaticities, float).reshape(4, 2)
    if not (xy[:, 1] > 0).all():
        raise ValueError("chromaticities without luminance")
    xyz = np.stack([xy[:, 0] / xy[:, 1], np.ones(4), (1 - xy.sum(axis=1)) / xy[:, 1]])
    try:
        scale = np.linalg.solve(xyz[:, :3], xyz[:, 3])
    except np.linalg.LinAlgError as error:
        raise ValueError("chromaticities on one line") from error
    return np.asarray(xyz[:, :3] * scale)


def model_of(profile: bytes) -> Model | None:
    """The color model of a profile; None for unsupported ones."""
    return _SIGNATURES.get(profile[16:20])


def by_profile(pixels: Float32[ndarray, "H W C"], profile: bytes, levels: int = 0) -> Float32[ndarray, "H W 3"]:
    """Values in [0, 1] of a profile's model to linear Rec.709; colors outside of it are negative or above 1. ValueError on a bad profile.

    levels: the divisor of integer values (255, 65535), or 0. Large images with a matrix profile then use one table per channel, which is
    ten times as fast.
    """
    imagecodecs = _codecs()

    model = model_of(profile)
    if model in ("rgb", "gray") and levels and pixels.size > MIN_TABLE_VALUES and (tables := _tables(profile, levels)) is not None:
        return _looked_up(pixels, tables, levels)
    values = np.ascontiguousarray(pixels[:, :, 0] if model == "gray" else pixels)
    if model == "cmyk":  # float inks are percentages there
        values = np.round(np.clip(values, 0, 1) * 65535).astype(np.uint16)
    try:
        return np.asarray(_converted(values, profile, "gray" if model == "gray" else str(model)), np.float32)
    except (imagecodecs.CmsError, ValueError, RuntimeError) as error:
        raise ValueError(f"a profile that Little CMS rejects: {error}") from error


@lru_cache(maxsize=4)
def _tables(profile: bytes, levels: int) -> ndarray | None:
    """The contribution of each channel, (C, levels + 1, 3) float32; None if a profile's channels are not additive (color tables)."""
    steps = np.linspace(0, 1, levels + 1, dtype=np.float32)
    if model_of(profile) == "gray":
        return by_profile(steps[None, :, None], profile)
    alone = np.zeros((3, levels + 1, 3), np.float32)
    for channel in range(3):
        alone[channel, :, channel] = steps
    tables = by_profile(alone, profile)
    tried = np.random.default_rng(0).integers(0, levels + 1, (1, 4096, 3))
    together = by_profile((tried / levels).astype(np.float32), profile)
    summed = sum(tables[c][tried[:, :, c]] for c in range(3))
    return tables if np.abs(tables[:, 0]).max() < LINEARITY_TOLERANCE and np.abs(summed - together).max() < LINEARITY_TOLERANCE else None


def _looked_up(pixels: Float32[ndarray, "H W C"], tables: ndarray, levels: int) -> Float32[ndarray, "H W 3"]:
    found = np.empty((*pixels.shape[:2], 3), np.float32)
    for row in range(0, len(pixels), 256):  # in blocks, for little memory
        index = np.rint(pixels[row : row + 256] * levels).astype(np.intp)
        part = np.take(tables[0], index[:, :, 0], axis=0)
        for channel in range(1, len(tables)):
            part += np.take(tables[channel], index[:, :, channel], axis=0)
        found[row : row + 256] = part
    return found


def from_lab(lab: Float32[ndarray, "H W 3"]) -> Float32[ndarray, "H W 3"]:
    """CIE L*a*b* under D50, as in TIFF, to linear Rec.709."""
    imagecodecs = _codecs()

    return np.asarray(_converted(np.ascontiguousarray(lab), imagecodecs.cms_profile("lab4"), "lab"), np.float32)


def _converted(values: ndarray, profile: bytes, space: str) -> ndarray:
    imagecodecs = _codecs()

    converted: ndarray = imagecodecs.cms_transform(
        values, profile, _linear_rec709(), colorspace=space, outcolorspace="rgb", outdtype=np.float32, intent=RELATIVE
    )
    return converted


@lru_cache(maxsize=1)
def _linear_rec709() -> bytes:
    imagecodecs = _codecs()

    x = REC709
    primaries = (x[0], x[1], 1.0, x[2], x[3], 1.0, x[4], x[5], 1.0)
    return bytes(imagecodecs.cms_profile("rgb", whitepoint=(x[6], x[7], 1.0), primaries=primaries, gamma=1.0))


@lru_cache(maxsize=16)
def character(profile: bytes) -> tuple[bool, bool]:
    """Whether a profile of gray or RGB is sRGB within an 8-bit step, and whether its curve is linear. ValueError on a bad one."""
    steps = np.linspace(0, 1, 9, dtype=np.float32)
    ramp = steps[None, :, None]
    if model_of(profile) == "gray":
        grid = ramp
    else:
        grid = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(1, -1, 3)
        ramp = np.repeat(ramp, 3, axis=2)
    is_srgb = bool(np.abs(by_profile(grid, profile) - decode_srgb(grid)).max() < SRGB_TOLERANCE)
    return is_srgb, bool(np.abs(by_profile(ramp, profile) - ramp).max() < SRGB_TOLERANCE)


@lru_cache(maxsize=16)
def name_of(profile: bytes) -> str:
    """A profile's description, in one line."""
    from PIL import ImageCms

    try:
        text = ImageCms.getProfileDescription(ImageCms.ImageCmsProfile(io.BytesIO(profile)))
    except (OSError, ImageCms.PyCMSError, ValueError):
        text = ""
    return " ".join(text.split())[:60] or "a space without a name"


def _codecs() -> Any:
    try:
        import imagecodecs
    except ImportError as error:
        raise MissingLibraryError("converting colors by a profile, and packed TIFF, need imagecodecs: pip install imagecodecs") from error
    return imagecodecs
