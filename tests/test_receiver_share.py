"""Shares of the texels, in turn over the lights, and captures whose lights have one: read as whole images, and completed."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from made_captures import write_capture

from srbf.capture import Capture
from srbf.complete import complete
from srbf.errors import ImageError, InputError, ManifestError
from srbf.evaluation.errors_by_role import evaluate
from srbf.io import files
from srbf.io.image import read_image, write_image
from srbf.methods.eigen_map import EigenMap
from srbf.receiver_share import Share, share_step, share_word, shares_in_turn
from srbf.sphere import point_set
from srbf.texel_interpolation import interpolation

HEIGHT, WIDTH = 7, 10
SMOOTH = 0.03  # error of a smooth picture from a quarter of it; most of so small a picture is border


@pytest.mark.parametrize(("width", "height", "step"), [(8, 6, 2), (7, 5, 2), (10, 7, 3), (3, 3, 3)])
def test_the_shares_of_a_step_are_all_texels_once(width: int, height: int, step: int) -> None:
    times = np.zeros((height, width), int)
    for share in {*shares_in_turn(3 * step**2, step)}:
        part = times[share.indices]
        assert share.size(width, height) == part.shape[::-1]
        part += 1
    assert (times == 1).all()


@pytest.mark.lengthy
@pytest.mark.parametrize("count", [400, 1536])
@pytest.mark.parametrize("step", [2, 3])
def test_neighbors_in_direction_have_other_shares(count: int, step: int) -> None:
    """As often equal as of random ones: one in step². The number of a Hammersley point alone tells its place."""
    directions = point_set("hammersley", count, "hemisphere")
    shares = shares_in_turn(count, step)
    counts = np.unique([shares.index(share) for share in shares], return_counts=True)[1]
    assert len(counts) == step**2 and counts.max() - counts.min() <= 0.15 * count / step**2
    nearest = np.argsort(-(directions @ directions.T), axis=1)[:, 1:7]
    equal = np.mean([[shares[i] == shares[j] for j in row] for i, row in enumerate(nearest)])
    assert equal < 1.25 / step**2


def test_words_of_shares() -> None:
    assert [share_step(word) for word in ("whole", "1", "1/4", "1/9", "1/64")] == [1, 1, 2, 3, 8]
    assert [share_word(step) for step in (1, 2, 8)] == ["whole", "1/4", "1/64"]
    for word in ("1/3", "1/1", "1/81", "quarter", "0.25", "-1/4", ""):
        with pytest.raises(InputError, match="expected a share of whole, 1/4"):
            share_step(word)


def whole_images(folder: Path) -> Capture:
    y, x = np.mgrid[:HEIGHT, :WIDTH] / 30.0

    def response(direction: np.ndarray) -> np.ndarray:
        return (1 + direction[0] * x + direction[1] * y)[:, :, None] * np.array([1.0, 0.5, 0.25])

    position = np.stack([x, y, 0 * x], axis=2)
    return write_capture(folder, response, lights=24, holdout=4, position=position, normal=np.broadcast_to([0.0, 0.0, 1.0], position.shape))


def parted(folder: Path, step: int = 2) -> Capture:
    """The same with a share of the train lights' texels."""
    whole = whole_images(folder)
    entries = whole.manifest["lights"]
    for entry, share in zip(entries, shares_in_turn(24, step), strict=False):
        image = read_image(folder / entry["file"], 3)
        write_image(folder / entry["file"], np.ascontiguousarray(image[share.indices]), "float")
        entry["share"] = share.json()
    files.write_json(folder / "capture.json", {**whole.manifest, "lights": entries})
    return Capture.open(folder)


@pytest.mark.lengthy
def test_a_share_is_read_as_a_whole_image(tmp_path: Path) -> None:
    whole, capture = whole_images(tmp_path / "whole"), parted(tmp_path / "parted")
    for i in range(len(capture.lights)):
        expected, image = whole.image(i), capture.image(i)
        share = capture.lights[i].share
        assert (share is None) == (capture.lights[i].role != "train")
        known = slice(None) if share is None else share.indices
        np.testing.assert_array_equal(image[known], expected[known])
        assert np.abs(image - expected).max() < 0.06  # at the border, half a spacing outside of what is known
        assert np.sqrt(((image - expected) ** 2).mean() / (expected**2).mean()) < SMOOTH
    every = list(range(len(capture.lights)))
    blocks = np.concatenate([block for _, block in capture.blocks(every)])
    stream = np.concatenate([block.copy() for _, block in capture.stream(every, rows=[(1, 3), (6, 7)])])
    texels = np.array([0, 13, 69])
    for i in every:
        np.testing.assert_array_equal(blocks[i].reshape(HEIGHT, WIDTH, 3), capture.image(i))
        np.testing.assert_array_equal(stream[i].reshape(3, WIDTH, 3), capture.image(i)[[1, 2, 6]])
        np.testing.assert_array_equal(capture.sample([i], texels)[:, 0], capture.image(i).reshape(-1, 3)[texels])
        np.testing.assert_array_equal(capture.partial_image(i)[0], capture.image(i))
    np.testing.assert_array_equal(capture.load().image(3), capture.image(3))
    np.testing.assert_array_equal(capture.load(texels).image(3)[0], capture.image(3).reshape(-1, 3)[texels])


@pytest.mark.lengthy
def test_a_capture_of_shares_is_fitted(tmp_path: Path) -> None:
    whole = whole_images(tmp_path / "whole")
    method = EigenMap(components=3)
    lost, least = (evaluate(method.encode(capture), whole)["holdout"]["relative_rmse"] for capture in (parted(tmp_path / "parted"), whole))
    assert least < lost < least + 2 * SMOOTH


def _positions(capture: Capture) -> np.ndarray:
    found = capture.channel("position")
    assert found is not None
    return found


def test_completed_images_are_those_that_are_read(tmp_path: Path) -> None:
    capture = parted(tmp_path / "parted")
    (capture.folder / "bake.log").write_text("of the bake alone")
    assert complete(capture, tmp_path / "completed") == 24
    completed = Capture.open(tmp_path / "completed")
    assert all(light.share is None for light in completed.lights) and not (completed.folder / "bake.log").exists()
    for i in range(len(capture.lights)):
        np.testing.assert_allclose(completed.image(i), capture.image(i), rtol=2.0**-11)
    np.testing.assert_array_equal(_positions(completed), _positions(capture))
    with pytest.raises(InputError, match="it is whole already"):
        complete(completed, tmp_path / "again")
    with pytest.raises(InputError, match="expected another folder than the capture's own"):
        complete(capture, capture.folder, force=True)


def test_regions_are_completed(tmp_path: Path) -> None:
    capture = whole_images(tmp_path / "capture")
    entries = capture.manifest["lights"]
    known = np.random.default_rng(5).random((HEIGHT, WIDTH)) < 0.5
    entries[2]["region"] = np.flatnonzero(known).tolist()
    files.write_json(capture.folder / "capture.json", {**capture.manifest, "lights": entries})
    holed = Capture.open(capture.folder)
    with pytest.raises(InputError, match="srbf complete"):
        holed.image(2)
    assert complete(holed, tmp_path / "completed") == 1
    image, expected = Capture.open(tmp_path / "completed").image(2), capture.image(2)
    np.testing.assert_allclose(image[known], expected[known], rtol=2.0**-11)
    assert np.abs(image - expected).max() < 0.1


@pytest.mark.parametrize(
    ("share", "error", "words"),
    [
        ({"step": 2, "offset": [0, 2]}, ManifestError, "expected an offset below the step 2 of the share of light 1"),
        ({"step": 1, "offset": [0, 0]}, ManifestError, "minimum"),
        ({"step": 2, "offset": [0]}, ManifestError, "offset"),
        ({"step": 3, "offset": [0, 0]}, ImageError, r"expected 4x3 texels of a share in .*0001\.exr, found 5x3"),
    ],
)
def test_bad_shares_are_one_line(tmp_path: Path, share: dict, error: type[Exception], words: str) -> None:
    capture = parted(tmp_path / "parted")
    manifest = json.loads((capture.folder / "capture.json").read_text())
    manifest["lights"][1]["share"] = share
    files.write_json(capture.folder / "capture.json", manifest)
    with pytest.raises(error, match=words) as caught:
        Capture.open(capture.folder).image(1)
    assert "\n" not in str(caught.value)


def test_a_share_and_a_region_exclude_each_other(tmp_path: Path) -> None:
    capture = parted(tmp_path / "parted")
    manifest = json.loads((capture.folder / "capture.json").read_text())
    manifest["lights"][1]["region"] = [0, 1]
    files.write_json(capture.folder / "capture.json", manifest)
    with pytest.raises(ManifestError, match="light 1 .*keep one"):
        Capture.open(capture.folder)


def test_interpolation_keeps_charts_apart() -> None:
    """Two charts side by side in the image, of two walls at right angles: no texel of one takes light of the other."""
    y, x = np.mgrid[:12, :12].astype(np.float32)
    left = x < 6
    position = np.where(left[:, :, None], np.stack([x, y, 0 * x], 2), np.stack([0 * x + 50, y, x], 2)).astype(np.float32)
    normal = np.where(left[:, :, None], [0.0, 0, 1], [1.0, 0, 0]).astype(np.float32)
    coverage = np.ones((12, 12), np.float32)
    coverage[:, 5] = 0
    light = np.where(x < 5, 1.0, 3.0).astype(np.float32)
    light[:, 5] = 100.0  # of nothing
    for offset in ((0, 0), (1, 0), (0, 1), (1, 1)):
        known = np.zeros((12, 12), bool)
        known[Share(2, offset).indices] = True
        filled = (interpolation(known, coverage, position, normal) @ light[known]).reshape(12, 12)
        np.testing.assert_allclose(filled[:, :5], 1, rtol=1e-6)
        np.testing.assert_allclose(filled[:, 6:], 3, rtol=1e-6)
        assert np.isin(np.round(filled[:, 5], 4), (1, 3)).all()


def test_interpolation_without_known_covered_texels_takes_all() -> None:
    known = np.zeros((4, 4), bool)
    known[0, 0] = True
    coverage = np.ones((4, 4), np.float32)
    coverage[0, 0] = 0
    assert ((interpolation(known, coverage) @ np.array([2.0], np.float32)) == 2).all()
