"""Manifests: what a reader asks for, ignores and refuses, in one line each."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from srbf.asset import Asset
from srbf.capture import BLOCK_BYTES, Capture
from srbf.errors import ImageError, ManifestError, SrbfError
from srbf.info import describe
from srbf.io.image import write_image
from srbf.methods.relighting_map import RelightingMap


@pytest.fixture
def capture(make_capture) -> Capture:
    return make_capture(lambda d: np.full((6, 8, 3), max(0, d[2])), lights=20, holdout=3)


def edit(folder: Path, **changes: object) -> None:
    """Change top-level keys of the folder's manifest; None removes one."""
    path = next(folder.glob("*.json"))
    manifest = {**json.loads(path.read_text()), **changes}
    path.write_text(json.dumps({key: value for key, value in manifest.items() if value is not None}))


def test_a_minimal_manifest_with_unknown_keys_is_read(capture: Capture) -> None:
    edit(capture.folder, maker="another renderer", shutter=[1, 2])
    again = Capture.open(capture.folder)
    assert (again.width, again.height, len(again.lights)) == (8, 6, 23)
    assert again.transport == "combined" and (again.coverage() == 1).all() and again.ambient() is None


def test_blocks_are_the_images_in_order(capture: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("srbf.capture.BLOCK_BYTES", 3 * 6 * 8 * 12)
    indices = capture.indices("train")
    seen = [(first, block.copy()) for first, block in capture.blocks(indices)]
    assert [first for first, _ in seen] == list(range(0, 20, 3))
    np.testing.assert_array_equal(np.concatenate([b for _, b in seen]).reshape(20, 6, 8, 3), [capture.image(i) for i in indices])
    assert BLOCK_BYTES < 1 << 28


@pytest.mark.parametrize("encoding", ["half", "float"])
def test_the_stream_is_the_images_as_stored(make_capture, encoding: str, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(3)
    capture = make_capture(lambda d: rng.normal(size=(6, 8, 3)), lights=20, encoding=encoding)
    stored = np.float16 if encoding == "half" else np.float32
    monkeypatch.setattr("srbf.capture.STREAM_BYTES", 3 * 6 * 8 * 3 * np.dtype(stored).itemsize)
    indices = capture.indices("train")[::-1]
    looked: dict[int, np.ndarray] = {}
    seen = [(first, block.copy()) for first, block in capture.stream(indices, lambda row, image: looked.update({row: image}))]
    assert [first for first, _ in seen] == list(range(0, 20, 3)) and all(block.dtype == stored for _, block in seen)
    expected = np.stack([capture.image(i).reshape(48, 3) for i in indices])
    np.testing.assert_array_equal(np.concatenate([block for _, block in seen]), expected)
    np.testing.assert_array_equal([looked[row] for row in range(20)], expected)
    assert list(capture.stream([])) == []


def test_one_float_image_keeps_the_whole_stream_float(capture: Capture) -> None:
    third = np.full((6, 8, 3), 1 / 3, np.float32)
    for i in range(20):
        write_image(capture.folder / capture.lights[i].file, third, "half" if i != 7 else "float")
    (_, block), *rest = capture.stream(capture.indices("train"))
    assert not rest and block.dtype == np.float32
    assert (block[7] == np.float32(1 / 3)).all() and (block[8] == np.float16(1 / 3)).all()


def test_a_sample_is_rows_of_the_transport_matrix(capture: Capture) -> None:
    indices, texels = [4, 0, 21], np.array([47, 3, 11])
    expected = np.stack([capture.image(i).reshape(48, 3)[texels] for i in indices], axis=1)
    np.testing.assert_array_equal(capture.sample(indices, texels), expected)


def test_a_stream_left_early_or_broken_ends(capture: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("srbf.capture.STREAM_BYTES", 1)
    stream = capture.stream(capture.indices("train"))
    next(stream)
    stream.close()
    write_image(capture.folder / capture.lights[5].file, np.zeros((6, 9, 3), np.float32), "half")
    with pytest.raises(ImageError, match=r"0005\.exr"):
        list(capture.stream(capture.indices("train")))


def bad_light(**changes: object) -> list[dict[str, object]]:
    return [{"kind": "directional", "direction": [0, 0, 1], "role": "train", "file": "lights/0000.exr", **changes}]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"version": 2}, "version 1"),
        ({"format": "srbf-asset"}, "format"),
        ({"quantity": "luminance"}, "quantity"),
        ({"width": 0}, "width"),
        ({"lights": None}, "lights"),
        ({"lights": []}, "lights"),
        ({"lights": bad_light(direction=[0, 0, 0])}, "unit direction"),
        ({"lights": bad_light(direction=[0, 0, 1.01])}, "unit direction"),
        ({"lights": bad_light(role="test")}, "role"),
        ({"lights": bad_light(file="../secret.exr")}, "inside"),
        ({"position": "/etc/passwd"}, "inside"),
    ],
)
def test_broken_captures_are_refused_in_one_line(capture: Capture, changes: dict, words: str) -> None:
    edit(capture.folder, **changes)
    with pytest.raises(ManifestError, match=words) as caught:
        Capture.open(capture.folder)
    assert "\n" not in str(caught.value)


def test_bad_images_are_named(capture: Capture) -> None:
    path = capture.folder / capture.lights[2].file
    write_image(path, np.zeros((6, 9, 3), np.float32), "half")
    with pytest.raises(ImageError, match=r"8x6.*0002\.exr.*9x6"):
        capture.image(2)
    path.unlink()
    with pytest.raises(ImageError, match=r"0002\.exr"):
        RelightingMap(k=3).encode(capture)


def test_no_manifest_and_no_json(tmp_path: Path) -> None:
    for opener in (Capture.open, Asset.open, describe):
        with pytest.raises(ManifestError, match=r"\.json"):
            opener(tmp_path)
    (tmp_path / "capture.json").write_text("{")
    with pytest.raises(ManifestError, match="syntax"):
        Capture.open(tmp_path)


@pytest.fixture
def saved(capture: Capture, tmp_path: Path) -> Path:
    RelightingMap(k=4).encode(capture).save(tmp_path / "asset")
    return tmp_path / "asset"


def test_damage_to_an_asset_is_noticed(saved: Path) -> None:
    data = bytearray((saved / "map_01.exr").read_bytes())
    data[-1] ^= 1
    (saved / "map_01.exr").write_bytes(data)
    with pytest.raises(ImageError, match=r"map_01\.exr.*checksum"):
        Asset.open(saved)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"version": 7}, "version"),
        ({"method": "magic"}, "method"),
        ({"basis": {"kind": "gaussian", "centers": [[0, 0, 1]], "spread": 0.5}}, "as many centers as maps"),
        ({"basis": {"kind": "gaussian", "centers": [[0, 0, 2]] * 4, "spread": 0.5}}, "unit centers"),
        ({"r_table": {"file": "../r.exr", "size": 64}}, "inside"),
        ({"position": "../p.exr"}, "inside"),
    ],
)
def test_broken_assets_are_refused(saved: Path, changes: dict, words: str) -> None:
    edit(saved, **changes)
    with pytest.raises(SrbfError, match=words):
        Asset.open(saved)


def test_a_table_of_another_spread_is_refused(saved: Path) -> None:
    basis = json.loads((saved / "asset.json").read_text())["basis"]
    edit(saved, basis={**basis, "spread": basis["spread"] * 1.1})
    with pytest.raises(ManifestError, match="R table"):
        Asset.open(saved)


def test_facts(saved: Path, capture: Capture) -> None:
    asset = describe(saved)
    assert asset["bytes_per_texel"]["directional"] == 4 * 4 * 2  # four maps, RGB counted as RGBA, half
    assert asset["resident_bytes"] == 48 * 32 + Asset.open(saved).table.nbytes
    assert describe(capture.folder)["lights"] == {"train": 20, "validation": 0, "holdout": 3}


def test_kept_captures_and_other_roles_are_the_images_on_disk(make_capture, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(9)
    coverage = (rng.random((6, 8)) > 0.3).astype(np.float32)
    capture = make_capture(lambda d: rng.normal(size=(6, 8, 3)), lights=10, holdout=3, validation=2, encoding="half", coverage=coverage)
    whole, texels = capture.kept(), np.array([40, 3, 17])
    some = capture.kept(texels)
    roles = ["holdout", None, *["train"] * 8, None, "validation", None, "train", "train"]
    assert (some.width, some.height) == (3, 1) and "position" not in some.manifest
    np.testing.assert_array_equal(some.coverage()[0], coverage.ravel()[texels])
    np.testing.assert_array_equal(whole.coverage(), coverage)
    indices = [12, 0, 14]
    monkeypatch.setattr("srbf.capture.STREAM_BYTES", 4 * 6 * 8 * 12)
    for again in (whole, capture.with_roles(roles), whole.with_roles(roles), some.with_roles(roles)):
        kept = [i for i, role in enumerate(roles) if role] if len(again.lights) < 15 else list(range(15))
        assert [light.direction for light in again.lights] == [capture.lights[i].direction for i in kept]
        chosen = slice(None) if again.width == 8 else texels
        images = [capture.image(i).reshape(-1, 3)[chosen] for i in kept]
        wanted = [i for i in indices if i < len(kept)]
        np.testing.assert_array_equal([again.image(i).reshape(-1, 3) for i in wanted], [images[i] for i in wanted])
        streamed = np.concatenate([block.copy() for _, block in again.stream(range(len(kept)))])
        np.testing.assert_array_equal(streamed, images)
        blocks = np.concatenate([block.copy() for _, block in again.blocks(range(len(kept)))])
        np.testing.assert_array_equal(blocks, images)
        picked = np.array([2, 0])
        np.testing.assert_array_equal(again.sample(wanted, picked), np.stack([images[i][picked] for i in wanted], axis=1))
    changed = capture.with_roles(roles)
    assert (changed.indices("holdout"), changed.indices("validation"), len(changed.indices("train"))) == ([0], [9], 10)
    assert capture.indices("holdout") == [12, 13, 14]  # as it was


def test_roles_are_one_a_light(capture: Capture) -> None:
    assert capture.with_roles([light.role for light in capture.lights]).lights == capture.lights
    assert not capture.with_roles([None] * 23).lights
