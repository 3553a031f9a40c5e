"""Manifests: what a reader asks for, ignores and refuses, in one line each."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.channels import CHANNELS, TOP_LEVEL, Channel, manifest_keys
from srbf.errors import ImageError, InputError, ManifestError, SrbfError
from srbf.info import describe
from srbf.io.image import write_image
from srbf.light_images import BLOCK_BYTES
from srbf.methods.relighting_map import RelightingMap
from srbf.schemas import load_schema


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
    monkeypatch.setattr("srbf.light_images.BLOCK_BYTES", 3 * 6 * 8 * 12)
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
    monkeypatch.setattr("srbf.light_images.STREAM_BYTES", 3 * 6 * 8 * 3 * np.dtype(stored).itemsize)
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
    monkeypatch.setattr("srbf.light_images.STREAM_BYTES", 1)
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
    whole, texels = capture.load(), np.array([40, 3, 17])
    some = capture.load(texels)
    roles = ["holdout", None, *["train"] * 8, None, "validation", None, "train", "train"]
    assert (some.width, some.height) == (3, 1) and "position" not in some.manifest
    np.testing.assert_array_equal(some.coverage()[0], coverage.ravel()[texels])
    np.testing.assert_array_equal(whole.coverage(), coverage)
    indices = [12, 0, 14]
    monkeypatch.setattr("srbf.light_images.STREAM_BYTES", 4 * 6 * 8 * 12)
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


def test_channels_are_read_by_name(make_capture) -> None:
    """Those of the table from keys of their own, others from `channels`, with as many components as the manifest says."""
    rng = np.random.default_rng(4)
    position, roughness = rng.random((6, 8, 3), np.float32), rng.random((6, 8, 1), np.float32)
    capture = make_capture(lambda d: np.zeros((6, 8, 3)), lights=4, position=position, coverage=np.ones((6, 8, 1), np.float32))
    write_image(capture.folder / "rough.exr", roughness, "float")
    edit(capture.folder, channels={"roughness": {"file": "rough.exr", "components": 1}})
    again = Capture.open(capture.folder)
    assert list(again.channels) == ["position", "coverage", "roughness"]
    assert again.channels["position"] is CHANNELS["position"] and again.channels["roughness"].components == 1
    np.testing.assert_array_equal(again.channel("position"), position)
    np.testing.assert_array_equal(again.geometry("position"), position)
    np.testing.assert_array_equal(again.channel("roughness"), roughness)
    assert again.channel("albedo") is None and again.channel("no such") is None
    some = again.load(np.array([3, 11]))
    assert list(some.channels) == ["coverage"] and some.channel("coverage").shape == (1, 2, 1)
    np.testing.assert_array_equal(again.load().channel("roughness"), roughness)


def test_the_schema_has_the_channels_of_the_table() -> None:
    """capture.json's top-level keys of channels are those of the table, and no further channel may take their names."""
    schema = load_schema("capture")
    assert set(TOP_LEVEL) <= set(CHANNELS) and set(TOP_LEVEL) <= set(schema["properties"])
    assert schema["properties"]["channels"]["propertyNames"]["not"]["enum"] == list(TOP_LEVEL)
    assert manifest_keys(TOP_LEVEL) == {name: f"{name}.exr" for name in TOP_LEVEL}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"channels": {"position": {"file": "p.exr", "components": 3}}}, "position"),
        ({"channels": {"roughness": {"file": "r.exr"}}}, "components"),
        ({"channels": {"roughness": {"file": "../r.exr", "components": 1}}}, "inside"),
        ({"receiver": {"kind": "sphere"}}, "'sphere' is not one of"),
        ({"receiver": {"kind": "lightmap", "camera": "Camera"}}, "'camera' was unexpected"),
        ({"receiver": {"kind": "view", "uv_layer": "UV"}}, "'uv_layer' was unexpected"),
        ({"receivers": [{"kind": "vertices", "count": 0}]}, "minimum"),
        ({"lights": bad_light(kind="laser")}, "'laser' is not one of"),
        ({"lights": bad_light(kind="point")}, "'position' is a required"),
        ({"lights": bad_light(region=[])}, "region"),
        ({"lights": bad_light(region=[1, 1])}, "region"),
        ({"lights": bad_light(region=[48])}, "below 48 in the region of light 0"),
        ({"lights": bad_light(region="../mask.exr")}, "inside"),
    ],
)
def test_broken_channels_receivers_and_regions_are_refused_in_one_line(capture: Capture, changes: dict, words: str) -> None:
    edit(capture.folder, **changes)
    with pytest.raises(ManifestError, match=words) as caught:
        Capture.open(capture.folder)
    assert "\n" not in str(caught.value)


def test_receivers_of_every_kind_are_read(capture: Capture) -> None:
    for receiver in (
        {"kind": "lightmap", "object": "A", "uv_layer": "UV"},
        {"kind": "view", "camera": "C"},
        {"kind": "vertices", "count": 3},
    ):
        edit(capture.folder, receiver=receiver)
        assert Capture.open(capture.folder).manifest["receiver"] == receiver


def test_a_known_channel_has_its_own_number_of_components(capture: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(CHANNELS, "roughness", Channel("roughness", 1, "of the microfacets"))
    assert manifest_keys(["position", "roughness"]) == {
        "position": "position.exr",
        "channels": {"roughness": {"file": "roughness.exr", "components": 1}},
    }
    edit(capture.folder, channels={"roughness": {"file": "r.exr", "components": 3}})
    with pytest.raises(ManifestError, match="expected 1 components of channel 'roughness'"):
        Capture.open(capture.folder)


def write_unchecked(path: Path, pixels: np.ndarray) -> None:
    """A float EXR as another program may write it, NaN included."""
    output = oiio.ImageOutput.create(str(path))
    output.open(str(path), oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], "float"))
    assert output.write_image(np.ascontiguousarray(pixels, np.float32)) and output.close()


@pytest.fixture
def holed(make_capture) -> tuple[Capture, np.ndarray, np.ndarray]:
    """A capture whose lights 1 (a mask) and 2 (indices) cover a region only, with NaN elsewhere; its whole images, and the regions."""
    rng = np.random.default_rng(6)
    capture = make_capture(lambda d: rng.random((6, 8, 3)), lights=4, encoding="float")
    whole = np.stack([capture.image(i) for i in range(4)])
    regions = rng.random((2, 6, 8)) > 0.5
    for i, region in zip((1, 2), regions, strict=True):
        write_unchecked(capture.folder / capture.lights[i].file, np.where(region[..., None], whole[i], np.float32(np.nan)))
    write_image(capture.folder / "mask.exr", regions[0][..., None].astype(np.float32), "float")
    lights = capture.manifest["lights"]
    lights[1]["region"], lights[2]["region"] = "mask.exr", np.flatnonzero(regions[1]).tolist()
    edit(capture.folder, lights=lights)
    return Capture.open(capture.folder), whole, regions


def test_a_region_of_a_light_is_read_with_its_image(holed) -> None:
    capture, whole, regions = holed
    assert capture.lights[0].region is None and capture.lights[1].region == "mask.exr"
    assert capture.region(0) is None
    for i, expected in ((0, np.ones((6, 8), bool)), (1, regions[0]), (2, regions[1])):
        image, known = capture.partial_image(i)
        np.testing.assert_array_equal(known, expected)
        np.testing.assert_array_equal(image, whole[i] * expected[..., None])
    np.testing.assert_array_equal(list(capture.blocks([0, 3]))[0][1].reshape(2, 6, 8, 3), whole[[0, 3]])  # others stay whole


def test_values_within_a_region_are_finite(holed) -> None:
    capture, whole, regions = holed
    write_unchecked(capture.folder / capture.lights[1].file, np.full((6, 8, 3), np.nan, np.float32))
    with pytest.raises(ImageError, match=r"0001\.exr"):
        capture.partial_image(1)


def test_what_needs_whole_images_names_the_command_that_completes_them(holed) -> None:
    capture, _, _ = holed
    for needs in (
        lambda: capture.image(1),
        lambda: list(capture.blocks([0, 1])),
        lambda: list(capture.stream([2])),
        lambda: capture.sample([0, 2], np.array([3])),
        capture.load,
        lambda: capture.with_roles(["train", "train", None, None]).image(1),
        lambda: RelightingMap(k=2).encode(capture),
    ):
        with pytest.raises(InputError, match=r"complete the capture first \(srbf complete\)") as caught:
            needs()
        assert "\n" not in str(caught.value)


def test_the_direct_light_of_a_region_is_added_within_it(holed) -> None:
    capture, whole, regions = holed
    lights = [{**light, "direct": "direct.exr"} for light in capture.manifest["lights"]]
    direct = np.full((6, 8, 3), 0.25, np.float32)
    write_image(capture.folder / "direct.exr", direct, "float")
    edit(capture.folder, lights=lights, transport="indirect")
    combined = Capture.open(capture.folder).combined()
    image, known = combined.partial_image(1)
    np.testing.assert_array_equal(image, (whole[1] + direct) * regions[0][..., None])
    image, known = combined.partial_image(0)
    assert known.all()
    np.testing.assert_array_equal(image, whole[0] + direct)
    with pytest.raises(InputError, match="srbf complete"):
        combined.image(2)
