"""The glossy eigen map on a ground below a ball: radiance toward viewers, linearity, environments, files, budget, what it refuses."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_cubemaps import HEIGHT, SIDE, WIDTH, made
from typer.testing import CliRunner

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.cli import app
from srbf.cubemap import Cubemap
from srbf.cubemap_capture import CubemapCapture
from srbf.errors import InputError, ManifestError
from srbf.evaluation.errors_by_role import evaluate
from srbf.evaluation.glossy_errors import glossy_errors
from srbf.fitting.options import fit, method_for
from srbf.info import describe
from srbf.lights import DirectionalLight, EnvironmentLight, PointLight
from srbf.methods import linear_response, radiance_to, relight
from srbf.methods.glossy_eigen_map import GlossyEigenMap
from srbf.sphere import normalize

pytest.importorskip("embreex")
pytest.importorskip("sklearn")
pytestmark = pytest.mark.slow

ROUGH = np.where(np.arange(WIDTH) < WIDTH // 2, 0.8, 1.0) * np.ones((HEIGHT, 1))
SMOOTH = 0.22  # relative RMSE of one sun: light functions blur shadows of directions 12 degrees apart
VIEWER = (1.5, -1.0, 1.2)
SUN = int(Cubemap(SIDE).texel_of(np.array([[0.3, 0.2, 1.0]]))[0])


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> CubemapCapture:
    found = made(tmp_path_factory.mktemp("glossy") / "capture", quantity="radiance", roughness=ROUGH)
    assert isinstance(found, CubemapCapture)
    return found


@pytest.fixture(scope="module")
def asset(capture: Capture) -> Asset:
    return fit(capture, GlossyEigenMap(clusters=4, components=12, terms=6))


def sun(column: int, color: tuple[float, float, float] = (1, 1, 1)) -> DirectionalLight:
    x, y, z = Cubemap(SIDE).directions[column].tolist()
    return DirectionalLight((x, y, z), color)


def ways(capture: Capture, viewer: tuple[float, float, float]) -> np.ndarray:
    position = capture.geometry("position")
    assert position is not None
    return normalize((np.array(viewer) - position).reshape(-1, 3)).reshape(position.shape)


def off(found: np.ndarray, true: np.ndarray, capture: Capture) -> float:
    covered = capture.coverage() > 0
    return float(np.linalg.norm((found - true)[covered]) / np.linalg.norm(true[covered]))


def test_a_train_light_is_seen_from_a_place(capture: CubemapCapture, asset: Asset) -> None:
    """Who forgets the viewer misses most of the lobe."""
    true = capture.toward(SUN, ways(capture, VIEWER))
    assert off(radiance_to(asset, [sun(SUN)], VIEWER), true, capture) < SMOOTH
    assert off(linear_response(asset, [sun(SUN)]), true, capture) > 1.3 * off(radiance_to(asset, [sun(SUN)], VIEWER), true, capture)
    assert off(linear_response(asset, [sun(SUN)]), capture.image(SUN), capture) < SMOOTH


def test_the_sum_is_linear_in_lights_and_colors(capture: Capture, asset: Asset) -> None:
    one, other = sun(SUN, (2.0, 0.5, 0.0)), sun(SUN + 9, (0.0, 1.0, 3.0))
    both = radiance_to(asset, [one, other], VIEWER)
    np.testing.assert_allclose(both, radiance_to(asset, [one], VIEWER) + radiance_to(asset, [other], VIEWER), atol=1e-4)
    white = radiance_to(asset, [sun(SUN)], VIEWER)
    np.testing.assert_allclose(radiance_to(asset, [one], VIEWER), white * np.array([2.0, 0.5, 0.0]), atol=1e-4)


def test_an_environment_that_turns_is_its_texels_that_turn(asset: Asset) -> None:
    """A quarter turn of a map of few texels is another map, and a bright texel is a sun."""
    image = np.random.default_rng(3).random((8, 16, 3)).astype(np.float32)
    turned = radiance_to(asset, [EnvironmentLight(image).turned(np.pi / 2)], VIEWER)
    np.testing.assert_allclose(turned, radiance_to(asset, [EnvironmentLight(np.roll(image, -4, axis=1))], VIEWER), rtol=1e-3, atol=1e-4)
    np.testing.assert_allclose(
        radiance_to(asset, [EnvironmentLight(2 * image)], VIEWER),
        2 * radiance_to(asset, [EnvironmentLight(image)], VIEWER),
        rtol=1e-3,
        atol=1e-4,
    )


def test_without_a_viewer_each_is_seen_from_straight_above(asset: Asset) -> None:
    above = (0.0, 0.0, 1e6)
    np.testing.assert_allclose(linear_response(asset, [sun(SUN)]), radiance_to(asset, [sun(SUN)], above), atol=1e-4)
    directions = Cubemap(SIDE).directions[[SUN, SUN + 5]]
    expected = np.stack([linear_response(asset, [sun(column)]) for column in (SUN, SUN + 5)])
    np.testing.assert_allclose(GlossyEigenMap.responses(asset, directions), expected, atol=1e-4)


def test_a_viewer_below_sees_finite_light(asset: Asset) -> None:
    found = relight(asset, [sun(SUN)], viewer=(0.2, 0.1, -3.0))
    assert np.isfinite(found).all() and (found >= 0).all()


def test_files_hold_what_was_fitted(asset: Asset, tmp_path: Path) -> None:
    asset.save(tmp_path / "asset")
    again = Asset.open(tmp_path / "asset")
    np.testing.assert_allclose(radiance_to(again, [sun(SUN)], VIEWER), radiance_to(asset, [sun(SUN)], VIEWER), rtol=1e-5, atol=1e-6)
    told = describe(tmp_path / "asset")
    assert told["terms"] == 6 and [one["roughness"] for one in told["gloss"]] == [0.8, 1.0] and told["bytes_per_texel"]["directional"] == 13
    few = asset.at(np.array([50, 7]))
    seen = linear_response(few, [sun(SUN)])[0]
    np.testing.assert_allclose(seen, linear_response(asset, [sun(SUN)]).reshape(-1, 3)[[50, 7]], rtol=1e-5, atol=1e-6)


def test_errors_toward_viewers_include_the_factorization(capture: Capture, asset: Asset) -> None:
    few = fit(capture, GlossyEigenMap(clusters=4, components=12, terms=1))
    found, by_few = (glossy_errors(one, capture, viewers=8)["holdout"] for one in (asset, few))
    assert 3 * found["factorization"] < by_few["factorization"] < by_few["relative_rmse"]
    assert found["factorization"] < found["relative_rmse"] < by_few["relative_rmse"] and found["mean"] <= found["worst"]
    assert 0 < evaluate(asset, capture, roles=("train",))["train"]["relative_rmse"] < SMOOTH


def test_the_command_line_fits_within_a_budget_evaluates_and_relights(capture: Capture, tmp_path: Path) -> None:
    def done(*words: object) -> str:
        result = CliRunner().invoke(app, [str(word) for word in words])
        assert result.exit_code == 0, result.output
        return result.output

    done("fit", capture.folder, "-o", tmp_path / "asset", "--budget", "8")
    opened = Asset.open(tmp_path / "asset")
    assert opened.method == GlossyEigenMap.name and opened.bytes_per_texel()["directional"] <= 8
    told = json.loads(done("evaluate", tmp_path / "asset", capture.folder, "--json"))
    assert told["viewers"]["holdout"]["factorization"] <= told["viewers"]["holdout"]["relative_rmse"] < 1
    assert "of the factorization alone" in done("evaluate", tmp_path / "asset", capture.folder)
    done("relight", tmp_path / "asset", "--directional", "0.3,0.2,1", "--viewer", "1.5,-1,1.2", "-o", tmp_path / "image.exr")
    refused = (
        ["view", tmp_path / "asset"],
        ["export", tmp_path / "asset", "--target", "gltf", "-o", tmp_path / "gltf"],
        ["report", tmp_path / "asset", capture.folder, "-o", tmp_path / "report.html"],
    )
    for words in refused:
        result = CliRunner().invoke(app, [str(word) for word in words])
        (line,) = [line for line in result.stderr.splitlines() if "expected an asset that" in line]
        assert result.exit_code == 1 and "glossy-eigen-map" in line


def test_what_it_cannot_do_is_refused_in_one_line(capture: Capture, asset: Asset, tmp_path: Path) -> None:
    plain = made(tmp_path / "plain", quantity="radiance")
    for settings in ({"terms": 0}, {"terms": 65}, {"clusters": 0}, {"components": 0}):
        with pytest.raises(InputError, match="expected"):
            method_for(capture, "glossy-eigen-map", settings)
    with pytest.raises(InputError, match="expected the gloss of receivers under a cubemap"):
        fit(plain, terms=4)
    with pytest.raises(InputError, match="expected directional or environment lights"):
        relight(asset, [PointLight((0.0, 0.0, 2.0))], viewer=VIEWER)
    with pytest.raises(InputError, match="expected an asset and a capture under a cubemap with gloss"):
        glossy_errors(asset, plain)
    bare = replace(asset, images={name: image for name, image in asset.images.items() if name != "position"})
    with pytest.raises(InputError, match="expected positions"):
        relight(bare, [sun(SUN)], viewer=VIEWER)


def test_a_manifest_with_other_terms_is_refused(asset: Asset, tmp_path: Path) -> None:
    asset.save(tmp_path / "asset")
    path = tmp_path / "asset" / "asset.json"
    manifest = json.loads(path.read_text())
    manifest["gloss"]["terms"] = 5
    path.write_text(json.dumps(manifest))
    with pytest.raises(ManifestError, match="5 `orders`"):
        Asset.open(tmp_path / "asset")
