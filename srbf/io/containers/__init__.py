"""Texture arrays in the files that GPUs load, DDS and KTX2, and BC7 and BC1 blocks in them."""

from __future__ import annotations

from pathlib import Path

from srbf.errors import ImageError
from srbf.io.containers import dds, ktx2
from srbf.io.containers.texture_array import TextureArray
from srbf.io.files import atomic_path

PACK = {".dds": dds.pack, ".ktx2": ktx2.pack}
UNPACK = {".dds": dds.unpack, ".ktx2": ktx2.unpack}


def read_texture_array(path: Path) -> TextureArray:
    """The array in a .dds or .ktx2 file; ImageError if it is not one that srbf writes, or truncated."""
    if path.suffix not in UNPACK:
        raise ImageError(f"expected a texture array named .dds or .ktx2, found {path}")
    if not path.is_file():
        raise ImageError(f"cannot read texture array {path}: no such file")
    try:
        return UNPACK[path.suffix](path.read_bytes())
    except ValueError as error:
        raise ImageError(f"expected a texture array as srbf export writes it in {path}, found {error}; export again") from error


def write_texture_array(path: Path, texture: TextureArray) -> None:
    """Write a .dds or .ktx2 file, atomically."""
    with atomic_path(path) as temporary:
        temporary.write_bytes(PACK[path.suffix](texture))
