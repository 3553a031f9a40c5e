"""What is real of a picture: a view's coverage as the alpha of what is shown of it. Lightmaps and vertices are textures and have none."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32
from srbf.asset import Asset
from srbf.io.image import encode_srgb, write_image

Alpha = Literal["straight", "premultiplied", "none"]


def alpha_of(asset: Asset) -> Float32[ndarray, "H W"] | None:
    """The coverage of a view, 0 to 1; None where all of it is covered, where nothing is known, and for lightmaps and vertices."""
    coverage = asset.images.get("coverage")
    if coverage is None or asset.receiver_kind != "view":
        return None
    alpha = np.clip(coverage, 0, 1).astype(np.float32)
    return None if (alpha == 1).all() else alpha


def over_black(linear: Float32[ndarray, "H W 3"], alpha: Float32[ndarray, "H W"] | None) -> Float32[ndarray, "H W 3"]:
    """The picture over black: `linear`, the color of the covered part of every pixel, times alpha, once."""
    return linear if alpha is None else linear * alpha[..., None]


def with_alpha(linear: Float32[ndarray, "H W 3"], alpha: Float32[ndarray, "H W"] | None, kind: Alpha) -> Float32[ndarray, "H W C"]:
    """Linear RGBA, or RGB without an alpha or by kind `none`, which leaves the values that fill the outside.

    `straight`: RGB is the color of the covered part, whole at edges, 0 where nothing is covered. `premultiplied`: RGB times alpha, what
    OpenEXR's convention and compositors expect [Porter1984].
    """
    if alpha is None or kind == "none":
        return linear
    color = over_black(linear, alpha if kind == "premultiplied" else (alpha > 0).astype(np.float32))
    return np.concatenate([color, alpha[..., None]], axis=2)


def write_png(path: Path, linear: Float32[ndarray, "H W 3"], alpha: Float32[ndarray, "H W"] | None, exposure: float = 0.0) -> None:
    """A PNG to look at: sRGB of clip(value 2^exposure), 8 bits; with `alpha` RGBA, straight as PNG defines it [W3C, PNG, 12.4]."""
    bytes_ = np.round(encode_srgb(np.clip(linear * 2.0**exposure, 0, 1)) * 255).astype(np.uint8)
    if alpha is not None:
        opacity = np.round(alpha * 255).astype(np.uint8)[..., None]
        bytes_ = np.concatenate([np.where(opacity > 0, bytes_, 0), opacity], axis=2)
    write_image(path, bytes_, "uint8")
