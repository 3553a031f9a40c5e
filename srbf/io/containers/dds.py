"""DDS with the DX10 header: one layer after the other, each with its levels from full size down."""

from __future__ import annotations

import struct

import numpy as np

from srbf.io.containers.dds_header import DX10, DXGI, LENGTH, MAGIC, TEXTURE_2D, header
from srbf.io.containers.texture_array import TextureArray, level_bytes, level_size

FORMS = {number: form for form, number in DXGI.items()}


def pack(texture: TextureArray) -> bytes:
    """The bytes of the file."""
    begin = header(texture.form, texture.width, texture.height, texture.layers, len(texture.levels))
    return begin + b"".join(level[i].tobytes() for i in range(texture.layers) for level in texture.levels)


def unpack(data: bytes) -> TextureArray:
    """The array in the bytes of a file; ValueError for files that `pack` does not write."""
    if len(data) < LENGTH or data[:4] != MAGIC:
        raise ValueError("no DDS header")
    height, width = struct.unpack_from("<2I", data, 12)
    (levels,) = struct.unpack_from("<I", data, 28)
    (fourcc,) = struct.unpack_from("<I", data, 84)
    number, dimension, flags, layers = struct.unpack_from("<4I", data, 128)
    if fourcc != DX10 or dimension != TEXTURE_2D or flags or number not in FORMS:
        raise ValueError(f"DXGI format {number} where {', '.join(map(str, FORMS))} are known")
    form = FORMS[number]
    if not (width and height and layers and 1 <= levels <= max(width, height).bit_length()):
        raise ValueError(f"{layers} layers of {levels} levels of {width}x{height} texels")
    sizes = [level_bytes(form, *level_size(width, height, level)) for level in range(levels)]
    if len(data) != LENGTH + layers * sum(sizes):
        raise ValueError(f"{len(data)} bytes where its header asks for {LENGTH + layers * sum(sizes)}")
    body = np.frombuffer(data, np.uint8, offset=LENGTH).reshape(layers, -1)
    ends = np.cumsum(sizes)
    return TextureArray(form, width, height, tuple(body[:, end - size : end] for size, end in zip(sizes, ends, strict=True)))
