"""Captures under a cubemap: images on request are visibility times cosine plus bounces; roles, rows, indirect ones; fits; damage."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from made_cubemaps import HEIGHT, SIDE, WIDTH, made

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.cubemap import Cubemap
from srbf.cubemap_capture import CubemapCapture
from srbf.cubemap_transport import BOUNCES_FILE, VISIBILITY_FILE, write_arrays
from srbf.errors import ImageError, ManifestError
from srbf.evaluation.errors_by_role import evaluate
from srbf.fitting.options import fit
from srbf.info import describe
from srbf.lights import DirectionalLight
from srbf.methods import linear_response

pytest.importorskip("embreex")


@pytest.fixture
def capture(tmp_path: Path) -> Capture:
    return made(tmp_path / "capture")


def test_every_texel_is_a_train_light(capture: Capture) -> None:
    assert isinstance(capture, CubemapCapture) and capture.is_cubemap and capture.kind == "directional"
    assert len(capture.indices("train")) == 6 * SIDE**2 and capture.indices("holdout") == [6 * SIDE**2, 6 * SIDE**2 + 1]
    np.testing.assert_allclose(capture.directions(capture.indices("train")), Cubemap(SIDE).directions)
    told = describe(capture.folder)
    assert told["lights"] == {"train": 6 * SIDE**2, "validation": 0, "holdout": 2} and told["cubemap"]["side"] == SIDE
    assert len({light.file for light in capture.lights}) == len(capture.lights)


def test_images_are_visibility_times_cosine_and_bounces(capture: Capture) -> None:
    """Away from the ball's shadow the direct light is the cosine; below the horizon there are bounces alone."""
    stored = np.load(capture.folder / BOUNCES_FILE)
    bounces = np.einsum("pr,rnc->pnc", stored["shapes"], stored["weights"])
    up = int(Cubemap(SIDE).texel_of(np.array([[0.1, 0.1, 1.0]]))[0])
    down = int(Cubemap(SIDE).texel_of(np.array([[0.1, 0.1, -1.0]]))[0])
    covered = capture.coverage().ravel() > 0
    for index in (up, down):
        direct = capture.image(index).reshape(-1, 3)[covered] - bounces[:, index]
        expected = max(0.0, float(Cubemap(SIDE).directions[index, 2]))
        lit = np.isclose(direct[:, 0], expected, atol=1e-5)
        np.testing.assert_allclose(direct[~lit], 0, atol=1e-5)
        assert lit.mean() > 0.6 and (index == down or not lit.all())
    assert not capture.image(up).reshape(-1, 3)[~covered].any()


def test_blocks_rows_and_images_agree(capture: Capture) -> None:
    indices = [0, 5, 6 * SIDE**2, 300, 6 * SIDE**2 + 1]
    images = np.stack([capture.image(i).reshape(-1, 3) for i in indices])
    for read in (capture.blocks(indices), capture.stream(indices)):
        np.testing.assert_allclose(np.concatenate([block.copy() for _, block in read]), images, atol=1e-6)
    texels = np.array([3, 100, WIDTH * HEIGHT - 1, 7])
    np.testing.assert_allclose(capture.sample(indices, texels), images[:, texels].transpose(1, 0, 2), atol=1e-6)
    rows = [(2, 5), (11, 12)]
    chosen = np.concatenate([np.arange(a * WIDTH, b * WIDTH) for a, b in rows])
    np.testing.assert_allclose(
        np.concatenate([block.copy() for _, block in capture.stream(indices, rows=rows)]), images[:, chosen], atol=1e-6
    )
    seen: dict[int, np.ndarray] = {}
    for _ in capture.stream(indices, lambda row, image: seen.update({row: image.copy()})):
        pass
    np.testing.assert_allclose(np.stack([seen[i] for i in range(len(indices))]), images, atol=1e-6)
    loaded = capture.load(texels)
    np.testing.assert_allclose(loaded.image(5), capture.image(5).reshape(-1, 3)[texels][None], atol=1e-6)
    half = capture.with_roles([("train" if i % 2 else "holdout") if i < 10 else None for i in range(len(capture.lights))])
    np.testing.assert_allclose(half.image(half.indices("train")[2]), capture.image(5), atol=1e-6)


def test_indirect_captures_leave_the_direct_light_out_and_add_it_again(tmp_path: Path) -> None:
    combined, indirect = made(tmp_path / "combined"), made(tmp_path / "indirect", "indirect")
    stored = np.load(indirect.folder / BOUNCES_FILE)
    covered = indirect.coverage().ravel() > 0
    np.testing.assert_allclose(indirect.image(9).reshape(-1, 3)[covered], stored["shapes"] @ stored["weights"][:, 9], atol=1e-6)
    assert indirect.has_direct
    np.testing.assert_allclose(indirect.combined().image(9), combined.image(9), atol=1e-6)
    np.testing.assert_allclose(indirect.combined().image(6 * SIDE**2), 2 * indirect.image(6 * SIDE**2), rtol=1e-5)


def test_radiance_is_irradiance_times_albedo_over_pi(tmp_path: Path) -> None:
    irradiance, radiance = made(tmp_path / "irradiance"), made(tmp_path / "radiance", quantity="radiance")
    albedo = radiance.geometry("albedo")
    assert albedo is not None
    np.testing.assert_allclose(radiance.image(40), irradiance.image(40) * albedo / np.pi, rtol=1e-5, atol=1e-7)
    np.testing.assert_allclose(radiance.sample([40], np.array([9]))[0, 0], radiance.image(40).reshape(-1, 3)[9], rtol=1e-5)


@pytest.mark.slow
def test_a_fit_within_a_budget_keeps_to_it_and_relights(capture: Capture, tmp_path: Path) -> None:
    said: list[str] = []
    asset = fit(capture, budget=16, say=said.append)
    assert asset.method == "clustered-eigen-map" and asset.bytes_per_texel()["directional"] <= 16 and "chose" in said[0]
    errors = evaluate(asset, capture, roles=("train",))
    assert errors["train"]["relative_rmse"] < 0.15
    index = int(Cubemap(SIDE).texel_of(np.array([[0.5, 0.2, 0.8]]))[0])
    x, y, z = Cubemap(SIDE).directions[index].tolist()
    relit, true = linear_response(asset, [DirectionalLight((x, y, z))]), capture.image(index)
    covered = capture.coverage() > 0
    assert np.linalg.norm((relit - true)[covered]) < 0.2 * np.linalg.norm(true[covered])
    assert asset.tables["light_coefficients"].dtype == np.float16
    asset.save(tmp_path / "asset")
    np.testing.assert_array_equal(linear_response(Asset.open(tmp_path / "asset"), [DirectionalLight((x, y, z))]), relit)


@pytest.mark.lengthy
def test_without_bounces_there_is_direct_light_alone(tmp_path: Path) -> None:
    """As in a convex scene, or where nothing reflects."""
    capture = made(tmp_path / "capture", rank=0)
    up = int(Cubemap(SIDE).texel_of(np.array([[0.1, 0.1, 1.0]]))[0])
    image = capture.image(up).reshape(-1, 3)
    assert set(np.unique(image.round(5))) == {0, np.float32(Cubemap(SIDE).directions[up, 2]).round(5)}
    texels = np.array([3, 100, 7])
    np.testing.assert_array_equal(capture.sample([up, 5], texels)[:, 0], image[texels])
    asset = fit(capture, budget=16)
    assert evaluate(asset, capture, roles=("train",))["train"]["relative_rmse"] < 0.15


@pytest.mark.parametrize("name", [VISIBILITY_FILE, BOUNCES_FILE])
@pytest.mark.parametrize("damage", ["missing", "truncated", "another"])
def test_damaged_files_are_named_in_one_line(capture: Capture, name: str, damage: str) -> None:
    path = capture.folder / name
    if damage == "missing":
        path.unlink()
    elif damage == "truncated":
        path.write_bytes(path.read_bytes()[:100])
    else:
        write_arrays(
            path,
            "made",
            bits=np.zeros((3, 3), np.uint8),
            receivers=np.arange(3),
            normals=np.zeros((3, 3), np.float32),
            shapes=np.zeros((3, 1)),
            weights=np.zeros((1, 3, 3)),
        )
    with pytest.raises(ImageError, match="expected the cubemap's visibility and bounces"):
        Capture.open(capture.folder).image(0)


@pytest.mark.parametrize(("key", "value"), [("side", 1), ("side", "32"), ("visibility", "../out.npz"), ("bounces", None)])
def test_a_broken_key_is_refused(capture: Capture, key: str, value: object) -> None:
    path = capture.folder / "capture.json"
    manifest = json.loads(path.read_text())
    manifest["cubemap"][key] = value
    path.write_text(json.dumps(manifest))
    with pytest.raises(ManifestError):
        Capture.open(capture.folder)
