"""How layers are stored: their encodings, files, and entries of asset.json."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32
from srbf.io.image import Encoding

LayerEncoding = Literal["half", "float", "uint8", "bc7", "bc1"]  # the last two: blocks of a texture array, bytes once decoded

TEXEL_BITS: dict[LayerEncoding, int] = {"half": 64, "float": 128, "uint8": 32, "bc7": 8, "bc1": 4}  # of a layer
DTYPE: dict[str, Any] = {"half": np.float16, "float": np.float32, "uint8": np.uint8}
ENCODING: dict[str, Encoding] = {"float16": "half", "float32": "float", "uint8": "uint8"}
SUFFIX: dict[Encoding, str] = {"half": "exr", "float": "exr", "uint8": "png"}


def layer_entries(stem: str, encoding: Encoding, scale: Float32[ndarray, "N C"], bias: Float32[ndarray, "N C"]) -> list[dict]:
    """The manifest's list of stored layers: file, encoding, scale, bias."""
    return [
        {
            "file": f"{stem}_{i:02d}.{SUFFIX[encoding]}",
            "encoding": encoding,
            "scale": scale[i].astype(float).tolist(),
            "bias": bias[i].astype(float).tolist(),
        }
        for i in range(len(scale))
    ]
