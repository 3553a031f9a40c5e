"""Texture arrays through their files: what is written is read again, and OpenImageIO sees the same texels in a DDS."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from srbf.errors import ImageError, InputError
from srbf.io.containers import ktx2, read_texture_array, write_texture_array
from srbf.io.containers.blocks import decode, encode
from srbf.io.containers.texture_array import TextureArray, level_bytes, level_size
from srbf.io.image import read_image

FORMS = ("bc7", "bc1", "uint8", "half")
BC7_ERROR, BC1_ERROR = 3.0, 9.0  # rms in bytes on a smooth picture; one block's colors lie on one or two lines


def picture(width: int, height: int, channels: int = 3, seed: int = 0) -> np.ndarray:
    """A smooth asymmetric picture in bytes."""
    y, x = np.mgrid[:height, :width] / 16
    waves = [np.sin((2 + c) * x / 3 + seed) * np.cos(y / (1 + c)) + 0.3 * x - 0.2 * y for c in range(channels)]
    stacked = np.stack(waves, axis=2)
    return np.round(255 * (stacked - stacked.min()) / np.ptp(stacked)).astype(np.uint8)


def array(form: str, width: int = 13, height: int = 6, layers: int = 3) -> TextureArray:
    levels = []
    for level in range(3):
        across, down = level_size(width, height, level)
        pixels = np.stack([picture(across, down, 4, seed=10 * level + i) for i in range(layers)])
        if form == "half":
            pixels = (pixels.astype(np.float32) / 100 - 1).astype(np.float16)
        levels.append(pixels)
    if form in ("bc7", "bc1"):
        blocks = tuple(np.stack([encode(layer[..., :3], form) for layer in level]) for level in levels)
        return TextureArray(form, width, height, blocks)
    return TextureArray.of(form, levels)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("suffix", [".dds", ".ktx2"])
def test_what_is_written_is_read_again(tmp_path: Path, form: str, suffix: str) -> None:
    texture = array(form)
    write_texture_array(tmp_path / f"t{suffix}", texture)
    again = read_texture_array(tmp_path / f"t{suffix}")
    assert (again.form, again.width, again.height, again.layers) == (form, 13, 6, 3)
    for level, (was, found) in enumerate(zip(texture.levels, again.levels, strict=True)):
        np.testing.assert_array_equal(found, was)
        assert again.pixels(level).shape == (3, *level_size(13, 6, level)[::-1], 4)


@pytest.mark.parametrize("form", ["bc7", "bc1", "uint8"])
def test_openimageio_reads_the_first_layer_of_a_dds(tmp_path: Path, form: str) -> None:
    texture = array(form, 24, 12)
    write_texture_array(tmp_path / "t.dds", texture)
    seen = np.round(read_image(tmp_path / "t.dds", 4) * 255)
    np.testing.assert_array_equal(seen, texture.pixels()[0])


@pytest.mark.parametrize(("form", "error"), [("bc7", BC7_ERROR), ("bc1", BC1_ERROR)])
def test_blocks_decode_to_the_picture(form: str, error: float) -> None:
    pixels = picture(30, 17)
    decoded = decode(np.stack([encode(pixels, form), encode(pixels[:, ::-1], form)]), form, 30, 17)
    for found, expected in zip(decoded, (pixels, pixels[:, ::-1]), strict=True):
        assert np.sqrt(np.square(found[..., :3].astype(float) - expected).mean()) < error
    turned = decoded[0, ::-1, :, :3].astype(float) - pixels
    assert np.sqrt(np.square(turned).mean()) > 3 * error  # row 0 is the top: turned it is another picture


def test_bc7_counts_its_channels_alike() -> None:
    """No eye's weights: noise in blue alone is kept as well as in green alone."""
    rng = np.random.default_rng(0)
    errors = []
    for channel in range(3):
        pixels = np.full((64, 64, 3), 90, np.uint8)
        pixels[..., channel] = rng.integers(60, 160, (64, 64))
        pixels[..., (channel + 1) % 3] = rng.integers(60, 160, (64, 64))
        found = decode(encode(pixels, "bc7")[None], "bc7", 64, 64)[0, ..., :3]
        errors.append(np.sqrt(np.square(found.astype(float) - pixels)[..., channel].mean()))
    assert max(errors) < 1.3 * min(errors)


def test_three_channels_are_opaque() -> None:
    assert (TextureArray.of("uint8", [picture(5, 4)[None]]).pixels()[..., 3] == 255).all()
    assert (TextureArray.of("half", [np.zeros((1, 4, 5, 3), np.float16)]).pixels()[..., 3] == 1).all()
    assert (decode(encode(picture(8, 8), "bc7")[None], "bc7", 8, 8)[..., 3] >= 254).all()


def test_ktx2_levels_lie_from_the_smallest_up_on_whole_blocks() -> None:
    data = ktx2.pack(array("bc7"))
    entries = [struct.unpack_from("<3Q", data, 80 + 24 * level) for level in range(3)]
    assert [length for _, length, _ in entries] == [3 * level_bytes("bc7", *level_size(13, 6, level)) for level in range(3)]
    starts = [start for start, _, _ in entries]
    assert starts == sorted(starts, reverse=True) and all(start % 16 == 0 for start in starts)
    assert starts[0] + entries[0][1] == len(data)
    descriptor, length = struct.unpack_from("<2I", data, 48)
    assert struct.unpack_from("<I", data, descriptor) == (length,) == (44,)
    assert data[descriptor + 12] == 134 and data[descriptor + 14] == 1  # BC7, linear transfer
    assert b"KTXorientation\0rd\0" in data


@pytest.mark.parametrize("suffix", [".dds", ".ktx2"])
def test_damaged_files_are_refused(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"t{suffix}"
    write_texture_array(path, array("bc7"))
    whole = path.read_bytes()
    for data in (b"", whole[:60], whole[:-1], bytes(len(whole)), whole[:28] + b"\xff" * 40 + whole[68:]):
        path.write_bytes(data)
        with pytest.raises(ImageError, match="texture array"):
            read_texture_array(path)
    path.unlink()
    with pytest.raises(ImageError, match="no such file"):
        read_texture_array(path)
    with pytest.raises(ImageError, match=".dds or .ktx2"):
        read_texture_array(tmp_path / "t.png")


def test_levels_of_another_size_are_refused() -> None:
    with pytest.raises(InputError, match="level 1"):
        TextureArray("uint8", 4, 4, (np.zeros((1, 64), np.uint8), np.zeros((1, 64), np.uint8)))
