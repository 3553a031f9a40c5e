"""KTX2 without supercompression: levels in the file from the smallest up, each with all layers [Khronos, KTX 2.0]."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from srbf.io.containers.dds_header import TexelFormat
from srbf.io.containers.texture_array import TextureArray, level_bytes, level_size

IDENTIFIER = b"\xabKTX 20\xbb\r\n\x1a\n"
HEADER, LEVEL = 80, 24
WRITER = "srbf export"


@dataclass(frozen=True)
class Described:
    """A format in Vulkan's and the data format descriptor's terms.

    `samples`: (bit offset, bits, channel and qualifiers, lower, upper) of each channel.
    """

    vulkan: int
    type_size: int
    model: int
    block: int  # texels per side
    plane: int  # bytes per block; levels start at multiples of it
    samples: tuple[tuple[int, int, int, int, int], ...]


RGBSDA, BC1A, BC7 = 1, 128, 134
CHANNELS = (0, 1, 2, 15)  # red, green, blue, alpha
FLOAT_SIGNED = 0xC0
MINUS_ONE, ONE = 0xBF800000, 0x3F800000
FORMATS: dict[TexelFormat, Described] = {
    "bc7": Described(145, 1, BC7, 4, 16, ((0, 128, 0, 0, 0xFFFFFFFF),)),  # VK_FORMAT_BC7_UNORM_BLOCK
    "bc1": Described(131, 1, BC1A, 4, 8, ((0, 64, 0, 0, 0xFFFFFFFF),)),  # VK_FORMAT_BC1_RGB_UNORM_BLOCK
    "uint8": Described(37, 1, RGBSDA, 1, 4, tuple((8 * i, 8, c, 0, 255) for i, c in enumerate(CHANNELS))),  # R8G8B8A8_UNORM
    "half": Described(97, 2, RGBSDA, 1, 8, tuple((16 * i, 16, c | FLOAT_SIGNED, MINUS_ONE, ONE) for i, c in enumerate(CHANNELS))),
}
BT709, LINEAR = 1, 1
DESCRIPTOR_VERSION = 2


def pack(texture: TextureArray) -> bytes:
    """The bytes of the file."""
    described = FORMATS[texture.form]
    descriptor, pairs = _descriptor(described), _key_values()
    count = len(texture.levels)
    at = HEADER + LEVEL * count
    descriptor_at, pairs_at = at, at + len(descriptor)
    at = pairs_at + len(pairs)
    index, body = [b""] * count, bytearray(descriptor + pairs)
    for level in reversed(range(count)):
        padding = -at % described.plane
        data = texture.levels[level].tobytes()
        body += bytes(padding) + data
        index[level] = struct.pack("<3Q", at + padding, len(data), len(data))
        at += padding + len(data)
    begin = struct.pack("<9I", described.vulkan, described.type_size, texture.width, texture.height, 0, texture.layers, 1, count, 0)
    places = struct.pack("<4I2Q", descriptor_at, len(descriptor), pairs_at, len(pairs), 0, 0)
    return IDENTIFIER + begin + places + b"".join(index) + bytes(body)


def unpack(data: bytes) -> TextureArray:
    """The array in the bytes of a file; ValueError for files that `pack` does not write."""
    if len(data) < HEADER or data[:12] != IDENTIFIER:
        raise ValueError("no KTX2 header")
    vulkan, _, width, height, depth, layers, faces, count, scheme = struct.unpack_from("<9I", data, 12)
    forms = {described.vulkan: form for form, described in FORMATS.items()}
    if vulkan not in forms or depth or faces != 1 or scheme:
        raise ValueError(f"Vulkan format {vulkan}, supercompression {scheme} where {', '.join(map(str, forms))} and 0 are known")
    if not (width and height and layers and 1 <= count <= max(width, height).bit_length() and len(data) >= HEADER + LEVEL * count):
        raise ValueError(f"{layers} layers of {count} levels of {width}x{height} texels")
    form, levels = forms[vulkan], []
    for level in range(count):
        start, length, _ = struct.unpack_from("<3Q", data, HEADER + LEVEL * level)
        size = layers * level_bytes(form, *level_size(width, height, level))
        if length != size or start + length > len(data):
            raise ValueError(f"{length} bytes at {start} in level {level} where {size} are asked for")
        levels.append(np.frombuffer(data, np.uint8, size, start).reshape(layers, -1))
    return TextureArray(form, width, height, tuple(levels))


def _descriptor(described: Described) -> bytes:
    """The one basic block of a data format descriptor [Khronos, Data Format 1.3]."""
    side = described.block - 1
    size = 24 + 16 * len(described.samples)
    block = struct.pack("<IHH", 0, DESCRIPTOR_VERSION, size)
    block += struct.pack("<4B", described.model, BT709, LINEAR, 0) + struct.pack("<4B8B", side, side, 0, 0, described.plane, *[0] * 7)
    for offset, bits, channel, lower, upper in described.samples:
        block += struct.pack("<HBB4BII", offset, bits - 1, channel, 0, 0, 0, 0, lower, upper)
    return struct.pack("<I", 4 + size) + block


def _key_values() -> bytes:
    pairs = b""
    for key, value in (("KTXorientation", "rd"), ("KTXwriter", WRITER)):  # u to the right, v down; sorted by key
        pair = key.encode() + b"\0" + value.encode() + b"\0"
        pairs += struct.pack("<I", len(pair)) + pair + bytes(-len(pair) % 4)
    return pairs
