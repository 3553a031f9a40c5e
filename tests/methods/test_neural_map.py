"""The neural map: what it learns, what it keeps on disk, that bytes and lights between cost little, and that nothing is lost in time."""

from __future__ import annotations

import importlib.util
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_assets import build_neural
from made_captures import write_capture
from typer.testing import CliRunner

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.cli import app
from srbf.errors import ImageError, InputError, ManifestError, MissingLibraryError
from srbf.evaluation.errors_by_role import evaluate
from srbf.fitting.options import implied_method
from srbf.io import files
from srbf.light_domain.distant_lights import NODES, nodes_of
from srbf.lights import DirectionalLight, EnvironmentLight, Light, NamedLight, PointLight, SpotLight
from srbf.methods import linear_response, projected_weights, relight, responses
from srbf.methods.eigen_map import EigenMap
from srbf.methods.neural_map import NeuralMap
from srbf.methods.protocol import FitRun
from srbf.sphere import normalize, random_directions

FLOAT32 = 1e-5  # of sums of a few dozen float32 products of numbers near 1
HEIGHT, WIDTH = 12, 16
SUN = DirectionalLight((0.3, 0.2, 0.9), (1, 0.5, 0.2))
POINT = PointLight((0.2, 0.1, 0.7), (0.4, 1, 0.3), a0=0.8)
LIGHTS: list[Light] = [
    SUN,
    POINT,
    SpotLight((0, -0.5, 1), (1, 1, 0.5), direction=(0, 0.5, -1), inner=0.2, outer=0.7),
    EnvironmentLight(np.random.default_rng(0).random((8, 16, 3)).astype(np.float32)),
]
trained = pytest.mark.skipif(importlib.util.find_spec("jax") is None, reason="jax is not installed: pip install srbf[neural]")


def glossy(direction: np.ndarray) -> np.ndarray:
    """Bumps with a highlight each, (H, W, 3): few numbers per texel, but no sum of few components."""
    y, x = np.mgrid[-1 : 1 : HEIGHT * 1j, -1 : 1 : WIDTH * 1j]
    normals = normalize(np.stack([0.6 * np.sin(3 * x), 0.6 * np.sin(4 * y), np.ones_like(x)], axis=-1))
    halfway = normalize(direction + np.array([0.0, 0.0, 1.0]))
    diffuse = np.maximum(normals @ direction, 0)[..., None] * [0.5, 0.3, 0.2]
    return diffuse + 0.5 * np.maximum(normals @ halfway, 0)[..., None] ** 40


@pytest.fixture(scope="module")
def bumps(tmp_path_factory: pytest.TempPathFactory) -> Capture:
    coverage = (np.random.default_rng(3).random((HEIGHT, WIDTH)) > 0.1).astype(np.float32)
    return write_capture(tmp_path_factory.mktemp("bumps") / "capture", glossy, lights=80, holdout=12, coverage=coverage)


@pytest.fixture(scope="module")
def learned(bumps: Capture) -> Asset:
    return NeuralMap(codes=4, steps=1000).encode(bumps)


@trained
@pytest.mark.slow
def test_highlights_that_components_cannot_follow_are_learned(bumps: Capture, learned: Asset) -> None:
    components = EigenMap(components=4, encoding="uint8").encode(bumps)
    own, theirs = (evaluate(asset, bumps, roles=("holdout",))["holdout"]["psnr"] for asset in (learned, components))
    assert own > theirs + 3  # two numbers per texel, its normal, tell all: 4 codes have room for them, 4 components do not


@trained
@pytest.mark.slow
def test_bytes_cost_next_to_nothing(bumps: Capture, learned: Asset) -> None:
    exact = NeuralMap(codes=4, steps=1000, encoding="float").encode(bumps)
    psnr = [evaluate(asset, bumps, roles=("holdout",))["holdout"]["psnr"] for asset in (exact, learned)]
    assert exact.stored.dtype == np.float32 and learned.stored.dtype == np.uint8
    assert psnr[1] > psnr[0] - 0.3


@trained
@pytest.mark.slow
def test_equal_seeds_are_equal_assets_and_others_are_not(bumps: Capture) -> None:
    one, two, other = (NeuralMap(codes=3, hidden=8, steps=60, seed=seed).encode(bumps) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.stored, two.stored)
    np.testing.assert_array_equal(one.tables["network"], two.tables["network"])
    assert one.manifest == two.manifest and (one.tables["network"] != other.tables["network"]).mean() > 0.9


@trained
@pytest.mark.slow
def test_training_ends_by_the_time_limit(bumps: Capture) -> None:
    said: list[str] = []
    NeuralMap(codes=3, hidden=8, steps=60).encode(bumps)  # what is compiled the first time is not part of the limit's accuracy
    started = time.monotonic()
    asset = NeuralMap(codes=3, hidden=8, steps=10**7, time_limit=4).encode(bumps, FitRun(say=said.append))
    assert time.monotonic() - started < 8
    steps = asset.manifest["source"]["fit"]["steps"]
    assert 50 < steps < 10**7 and said == [f"the time limit of 4 s sufficed for {steps} of 10000000 steps of training"]


@trained
@pytest.mark.slow
def test_an_interrupted_training_keeps_what_it_has_learned(bumps: Capture) -> None:
    said: list[str] = []

    def press(done: int, total: int) -> None:
        if done > 0.95 * total:
            raise KeyboardInterrupt

    asset = NeuralMap(codes=4, steps=800).encode(bumps, FitRun(press, say=said.append))
    steps = asset.manifest["source"]["fit"]["steps"]
    assert said == [f"interrupted after {steps} of 800 steps of training: fitting with what it has learned"] and 700 < steps < 800
    mean = NeuralMap(codes=4, steps=1).encode(bumps)
    error = [evaluate(found, bumps, roles=("holdout",))["holdout"]["rmse"] for found in (asset, mean)]
    assert error[0] < 0.3 * error[1]


@trained
@pytest.mark.slow
def test_the_disk_holds_all_of_it(learned: Asset, tmp_path: Path) -> None:
    learned.save(tmp_path / "asset")
    again = Asset.open(tmp_path / "asset")
    np.testing.assert_array_equal(again.stored, learned.stored)
    np.testing.assert_array_equal(again.tables["network"], learned.tables["network"])
    np.testing.assert_array_equal(relight(again, [SUN]), relight(learned, [SUN]))
    assert again.manifest == learned.manifest and again.bytes_per_texel()["directional"] == 4


@trained
@pytest.mark.slow
def test_uncovered_texels_hold_the_code_of_a_covered_neighbor(learned: Asset) -> None:
    covered = np.argwhere(learned.covered)
    for row, column in np.argwhere(~learned.covered):
        distance = np.linalg.norm(covered - [row, column], axis=1)
        among = covered[distance == distance.min()]
        assert any((learned.stored[:, r, c] == learned.stored[:, row, column]).all() for r, c in among)


def test_response_is_linear_in_color_and_additive() -> None:
    asset = build_neural()
    for light in LIGHTS:
        one = linear_response(asset, [light])
        red, green, blue = light.color
        twice = linear_response(asset, [replace(light, color=(2 * red, 2 * green, 2 * blue))])
        np.testing.assert_allclose(twice, 2 * one, atol=FLOAT32 * np.abs(one).max())
    apart = np.sum([linear_response(asset, [light]) for light in LIGHTS], axis=0)
    np.testing.assert_allclose(linear_response(asset, LIGHTS), apart, atol=FLOAT32 * np.abs(apart).max())
    np.testing.assert_array_equal(relight(asset, []), asset.images["ambient"])


def test_many_directions_at_once_are_each_by_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    asset = build_neural()
    directions = random_directions(5, "sphere", np.random.default_rng(0))
    together = responses(asset, directions)
    apart = np.stack([linear_response(asset, [DirectionalLight(tuple(d))]) for d in directions])
    np.testing.assert_allclose(together, apart, atol=FLOAT32 * np.abs(apart).max())
    whole = linear_response(asset, LIGHTS)
    monkeypatch.setattr("srbf.methods.over_lights.CHUNK", 3 * 14)  # does not divide the 9 rows
    np.testing.assert_allclose(responses(asset, directions), together, atol=FLOAT32 * np.abs(together).max())
    np.testing.assert_allclose(linear_response(asset, LIGHTS), whole, atol=FLOAT32 * np.abs(whole).max())


def test_a_distant_point_light_is_a_sun() -> None:
    asset = build_neural()
    far = PointLight((3e4, 2e4, 9e4), SUN.color, a0=float(np.linalg.norm([3e4, 2e4, 9e4])))
    expected = linear_response(asset, [SUN])
    np.testing.assert_allclose(linear_response(asset, [far]), expected, atol=1e-3 * np.abs(expected).max())  # 1 m of parallax in 1e5


def test_an_environment_of_one_bright_texel_is_a_sun_from_the_nearest_node() -> None:
    asset = build_neural()
    image = np.zeros((32, 64, 3), np.float32)
    image[9, 20] = 3, 2, 1
    weights = projected_weights(asset, [EnvironmentLight(image)])
    (node,) = np.flatnonzero(weights.any(axis=1))
    elevation, azimuth = np.pi / 2 - 9.5 * np.pi / 32, np.pi - 20.5 * np.pi / 32
    direction = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
    assert weights.shape == (NODES, 3) and node == np.argmax(nodes_of(asset.manifest) @ direction)
    sun = DirectionalLight(tuple(nodes_of(asset.manifest)[node]), tuple(weights[node]))
    expected = linear_response(asset, [sun])
    np.testing.assert_allclose(linear_response(asset, [EnvironmentLight(image)]), expected, atol=FLOAT32 * np.abs(expected).max())


def test_a_moved_asset_is_lit_where_it_stands() -> None:
    asset = build_neural()
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    to_asset = np.eye(4)
    to_asset[:3, :3] = turn.T
    moved = replace(asset, manifest={**asset.manifest, "asset_from_world": to_asset.tolist()})
    expected = linear_response(asset, LIGHTS[:2])
    turned: list[Light] = [replace(SUN, direction=tuple(turn @ SUN.direction)), replace(POINT, position=tuple(turn @ POINT.position))]
    np.testing.assert_allclose(linear_response(moved, turned), expected, atol=FLOAT32 * np.abs(expected).max())


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"codes": 0}, "expected 1 to 32 `codes`, found 0"),
        ({"hidden": 18}, "expected a multiple of 4 up to 32 as `hidden`, found 18"),
        ({"steps": 0}, "expected 1 or more `steps`, found 0"),
        ({"time_limit": 0}, "expected a `time_limit` above 0 s, found 0"),
    ],
)
def test_wrong_settings_are_refused(settings: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        NeuralMap(**settings)


def test_lights_without_a_weight_are_refused() -> None:
    with pytest.raises(InputError, match="expected environment lights for weights of a neural-map asset, found a directional light"):
        projected_weights(build_neural(), [SUN])
    with pytest.raises(InputError, match="named"):
        linear_response(build_neural(), [NamedLight("Desk")])


def test_a_network_of_another_size_is_refused(tmp_path: Path) -> None:
    asset = build_neural()
    asset.manifest |= {"format": "srbf-asset", "version": 1, "position": "position.exr", "ambient": "ambient.exr"}
    scale, bias = asset.scale.tolist(), asset.bias.tolist()
    asset.manifest["planes"] = [
        {"file": f"plane_{i:02d}.png", "encoding": "uint8", "scale": s, "bias": b} for i, (s, b) in enumerate(zip(scale, bias, strict=True))
    ]
    asset.save(tmp_path / "asset")
    path = tmp_path / "asset" / "asset.json"
    manifest = files.read_json(path)
    files.write_json(path, {**manifest, "network": {**manifest["network"], "hidden": 12}})
    with pytest.raises(ImageError, match="expected 12x30 texels in .*network.exr, found 8x26"):
        Asset.open(tmp_path / "asset")
    files.write_json(path, {**manifest, "scalars": 13})
    with pytest.raises(ManifestError, match="expected 13 codes four to an image in .*, found 3 images"):
        Asset.open(tmp_path / "asset")


def test_codes_imply_the_method() -> None:
    assert implied_method({"codes": 9}) == NeuralMap.name


def test_without_jax_a_fit_says_what_to_install(bumps: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "jax", None)
    with pytest.raises(MissingLibraryError, match=r"a neural map is trained by jax: pip install srbf\[neural\]"):
        NeuralMap().encode(bumps)


@pytest.mark.slow
def test_the_command_takes_a_duration_and_refuses_another_word(bumps: Capture, tmp_path: Path) -> None:
    arguments = ["fit", str(bumps.folder), "-o", str(tmp_path / "asset"), "--method", NeuralMap.name, "--time-limit"]
    refused = CliRunner().invoke(app, [*arguments, "soon"])
    assert refused.exit_code == 2 and "expected a duration as 90s, 30m or 8h, found 'soon'" in refused.output
    if importlib.util.find_spec("jax") is not None:
        assert CliRunner().invoke(app, [*arguments, "1m30s", "--steps", "2", "--hidden", "4"]).exit_code == 0
        settings = Asset.open(tmp_path / "asset").manifest["source"]["settings"]
        assert settings["time_limit"] == 90 and settings["steps"] == 2 and settings["hidden"] == 4
