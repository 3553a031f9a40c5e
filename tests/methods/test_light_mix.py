"""Light mixing: a mix is the sum of its lights, exactly with a map each, nearly in a few bytes; names that are wrong are refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_names import NAMES, capture_of_names, smooth_images

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.errors import InputError
from srbf.evaluation.errors_by_role import evaluate
from srbf.fitting.options import fit
from srbf.lights import DirectionalLight, NamedLight
from srbf.methods import linear_response, projected_weights, relight, responses
from srbf.methods.light_mix import LightMix, mixes
from srbf.methods.named_maps import NamedMaps

pytest.importorskip("sklearn")

SHAPE = (24, 24)
HALF = 2e-3  # relative: captured images and maps are half floats


@pytest.fixture(scope="module")
def capture(tmp_path_factory) -> Capture:
    return capture_of_names(tmp_path_factory.mktemp("named") / "capture", smooth_images(len(NAMES), *SHAPE))


@pytest.fixture(scope="module", params=["one cluster", "clusters", "maps"])
def asset(request, capture: Capture) -> Asset:
    method = {"one cluster": LightMix(1, 20), "clusters": LightMix(4, 12, encoding="half"), "maps": NamedMaps()}[request.param]
    return method.encode(capture)


def mix(weights: np.ndarray) -> list[NamedLight]:
    return [NamedLight(name, tuple(color)) for name, color in zip(NAMES, weights.tolist(), strict=True)]


def test_a_mix_is_the_sum_of_its_lights(asset: Asset, capture: Capture) -> None:
    weights = np.random.default_rng(1).uniform(0, 2, (len(NAMES), 3))
    relit = linear_response(asset, mix(weights))
    truth = sum(capture.image(i) * weights[i].astype(np.float32) for i in range(len(NAMES)))
    covered = capture.coverage() > 0
    error = np.sqrt(((relit - truth)[covered] ** 2).mean() / (truth[covered] ** 2).mean())
    assert error < (HALF if asset.method == "named-maps" else 0.02)
    alone = [linear_response(asset, [light]) for light in mix(weights)]
    np.testing.assert_allclose(relit, np.sum(alone, axis=0), atol=2e-5 * relit.max())


def test_no_light_and_lights_that_are_off_leave_ambient(asset: Asset) -> None:
    assert not relight(asset, []).any()
    assert not relight(asset, [NamedLight(name, (0, 0, 0)) for name in NAMES]).any()


def test_the_order_of_lights_does_not_matter(asset: Asset) -> None:
    lights = mix(np.random.default_rng(4).uniform(0, 2, (len(NAMES), 3)))
    np.testing.assert_allclose(projected_weights(asset, lights), projected_weights(asset, lights[::-1]), rtol=1e-12, atol=1e-12)


def test_coordinates_are_intensities(asset: Asset) -> None:
    weights = np.random.default_rng(5).uniform(0, 2, (2, len(NAMES)))
    lit = [linear_response(asset, mix(np.repeat(row[:, None], 3, axis=1))) for row in weights]
    np.testing.assert_allclose(responses(asset, weights), lit, atol=2e-5 * np.max(lit))


def test_the_asset_on_disk_is_the_asset(asset: Asset, tmp_path: Path) -> None:
    asset.save(tmp_path / "asset")
    lights = mix(np.ones((len(NAMES), 3)))
    np.testing.assert_array_equal(relight(Asset.open(tmp_path / "asset"), lights), relight(asset, lights))


def test_other_lights_are_refused_by_name(asset: Asset) -> None:
    with pytest.raises(InputError, match="expected a light of the asset, found 'Moon'; its lights are 'Desk lamp', 'Window'"):  # words: ok
        relight(asset, [NamedLight("Moon")])
    with pytest.raises(InputError, match="found a directional light"):
        relight(asset, [DirectionalLight((0, 0, 1))])


def test_a_budget_is_kept_and_good(capture: Capture) -> None:
    chosen = fit(capture, budget=13)
    assert chosen.method == "light-mix" and chosen.bytes_per_texel()["directional"] <= 13
    assert evaluate(chosen, capture)["train"]["psnr"] > 40
    assert fit(capture, exact=True).method == "named-maps"


def test_names_that_clash_are_refused(tmp_path: Path) -> None:
    twice = capture_of_names(tmp_path / "capture", smooth_images(2, 8, 8), ("Desk", "Desk"))
    with pytest.raises(InputError, match="a name of its own for every light .* found 'Desk' twice"):
        LightMix().encode(twice)


@pytest.mark.lengthy
def test_more_than_a_thousand_names(tmp_path: Path) -> None:
    count = 1030
    names = tuple(f"Bulb {i:04d}" for i in range(count))
    images = np.broadcast_to(np.linspace(0, 1, count)[:, None, None, None], (count, 2, 2, 3)).astype(np.float32)
    asset = LightMix(1, 4).encode(capture_of_names(tmp_path / "capture", images, names, holes=False))
    lit = relight(asset, [NamedLight(name) for name in names])
    assert lit.mean() == pytest.approx(count / 2, rel=HALF)


def test_one_light_is_enough(tmp_path: Path) -> None:
    one = capture_of_names(tmp_path / "capture", smooth_images(1, 8, 8), ("Sun",))
    asset = fit(one, budget=13)
    error = np.abs(relight(asset, [NamedLight("Sun")]) - one.image(0))[one.coverage() > 0].max()
    assert error < 0.02 * one.image(0)[one.coverage() > 0].max()


def test_mixtures_weigh_errors_as_random_mixes_do() -> None:
    assert mixes(5) @ mixes(5) == pytest.approx(np.ones((5, 5)) + np.eye(5) / 3)


@pytest.mark.parametrize("settings", [{"clusters": 0}, {"components": 0}, {"clusters": 257}])
def test_settings_out_of_range_are_refused(settings: dict) -> None:
    with pytest.raises(InputError, match="expected"):
        LightMix(**settings)


def test_patches_cannot_be_mixed(capture: Capture) -> None:
    with pytest.raises(InputError, match="expected a capture in the light domain directions for method eigen-map, found named"):
        fit(capture, "eigen-map", components=4)
    assert replace(capture).kind == "named"
