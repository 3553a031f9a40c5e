"""Environments integrated by shaders: the weights of every method, and pictures lit by them, against numpy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from srbf import methods
from srbf.asset import Asset
from srbf.errors import InputError
from srbf.lights import DirectionalLight, EnvironmentLight, Light, PointLight
from srbf.methods import projected_weights
from srbf.relighting.relighter import Relighter

SUM = 1e-5  # the contract, of the sum of all terms' sizes
TURN = [[0, 0, 2.0, 0.1], [2.0, 0, 0, 0.2], [0, 2.0, 0, -0.3], [0, 0, 0, 1]]  # lays the horizon on its side, twice as large


def environment(seed: int) -> EnvironmentLight:
    image = np.random.default_rng(seed).random((9, 20, 3)).astype(np.float32) ** 4  # its middle row straddles the horizon
    return EnvironmentLight(image, (0.3, 0.2, 0.1))


@pytest.fixture(params=["relighting-map", "eigen-map", "clustered-eigen-map"])
def asset(request: Any, make_asset: Callable[..., Asset], make_planes: Callable[..., Asset]) -> Asset:
    if request.param == "relighting-map":
        return make_asset(25)
    return make_planes(9, 5 if request.param.startswith("clustered") else None)


def sizes(asset: Asset) -> np.ndarray:
    """What the terms of a weight add up to at most, (F, 1)."""
    total = sum(
        float((light.image.max(axis=2) * np.array(light.color).max()).sum()) / light.image[..., 0].size
        for light in (environment(1), environment(2))
    )
    if asset.method == "relighting-map":
        return np.full((asset.k, 1), 4 * np.pi * total)
    return 4 * np.pi * total * np.abs(asset.light_functions.coefficients).sum(axis=(1, 2))[:, None]


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("domain", ["sphere", "hemisphere"])
def test_the_weights_of_environments_are_numpys(context: Any, asset: Asset, domain: str, turned: bool) -> None:
    asset.manifest["domain"] = domain
    if turned:
        asset.manifest["asset_from_world"] = TURN
    lights: list[Light] = [environment(1), DirectionalLight((0.3, 0.5, 0.8), (0.2, 0.8, 0.3)), environment(2)]
    with Relighter(asset, context=context, environments="gpu") as relighter:
        relighter.draw(lights)
        assert relighter._environment is not None
        with context:
            found = relighter._environment.read()
    expected = projected_weights(asset, lights)
    assert found.shape == expected.shape
    assert (np.abs(found - expected) <= SUM * (sizes(asset) + np.abs(expected))).all()
    assert np.abs(expected).max() > 100 * SUM * sizes(asset).max()


@pytest.mark.parametrize("multipass", [False, True])
def test_a_picture_under_environments_of_the_gpu_is_numpys(context: Any, asset: Asset, multipass: bool) -> None:
    lights: list[Light] = [environment(1), PointLight((0.4, -0.2, 1.1), (1.0, 0.5, 2.0)), DirectionalLight((0.3, 0.5, 0.8)), environment(2)]
    with Relighter(asset, context=context, environments="gpu") as relighter:
        found = relighter.relight(lights, multipass=multipass)
        assert (relighter.relight([environment(1)]) != relighter.relight([environment(2)])).any()  # it may change from frame to frame
        dark = relighter.relight([EnvironmentLight(np.zeros((3, 4, 3), np.float32))])
        assert (dark == 0).all()
    expected = methods.relight(asset, lights)
    np.testing.assert_allclose(found, expected, atol=3e-5 * expected.max())
    assert np.abs(expected - methods.relight(asset, lights[1:3])).max() > 0.1 * expected.max()


def test_places_that_are_none_are_refused(context: Any, make_asset: Callable[..., Asset]) -> None:
    with pytest.raises((InputError, TypeError)):  # TypeError where annotations are checked at run time
        Relighter(make_asset(), context=context, environments="nowhere")  # type: ignore[arg-type]
