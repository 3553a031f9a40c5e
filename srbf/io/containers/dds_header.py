"""The 148 bytes before the texels of a DDS file with the DX10 extension [Microsoft, "DDS_HEADER_DXT10"]."""

from __future__ import annotations

import struct
from typing import Literal

MAGIC = b"DDS "
SIZE, PIXEL_FORMAT_SIZE, LENGTH = 124, 32, 148
TexelFormat = Literal["bc7", "bc1", "uint8", "half"]
DXGI: dict[TexelFormat, int] = {"bc7": 98, "bc1": 71, "uint8": 28, "half": 10}  # BC7_UNORM, BC1_UNORM, R8G8B8A8_UNORM, R16G16B16A16_FLOAT
CAPS, HEIGHT, WIDTH, PITCH, PIXEL_FORMAT, MIPMAPS, LINEAR_SIZE = 1, 2, 4, 8, 0x1000, 0x20000, 0x80000
FOURCC, DX10 = 4, 0x30315844
COMPLEX, TEXTURE, MIPMAP = 8, 0x1000, 0x400000
TEXTURE_2D = 3
BITS = {"bc7": 8, "bc1": 4, "uint8": 32, "half": 64}  # per texel


def header(form: TexelFormat, width: int, height: int, layers: int = 1, levels: int = 1) -> bytes:
    """For `layers` of one size with `levels` each, the full size included: every layer's levels follow each other."""
    blocks = form.startswith("bc")
    pitch = -(-width // 4) * -(-height // 4) * 2 * BITS[form] if blocks else width * BITS[form] // 8
    flags = CAPS | HEIGHT | WIDTH | PIXEL_FORMAT | MIPMAPS | (LINEAR_SIZE if blocks else PITCH)
    caps = TEXTURE | (MIPMAP | COMPLEX if levels > 1 else 0) | (COMPLEX if layers > 1 else 0)
    return (
        struct.pack("<4s7I44x", MAGIC, SIZE, flags, height, width, pitch, 0, levels)
        + struct.pack("<8I", PIXEL_FORMAT_SIZE, FOURCC, DX10, 0, 0, 0, 0, 0)
        + struct.pack("<5I", caps, 0, 0, 0, 0)
        + struct.pack("<5I", DXGI[form], TEXTURE_2D, 0, layers, 0)
    )
