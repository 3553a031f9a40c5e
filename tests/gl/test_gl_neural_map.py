"""A neural map by shaders equals numpy under every kind and number of lights."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from made_assets import build_neural

from srbf.errors import InputError, ShaderError
from srbf.gl.context import Limits
from srbf.io.image import Encoding
from srbf.lights import DirectionalLight, EnvironmentLight, Light, PointLight, SpotLight
from srbf.methods import relight
from srbf.relighting.relighter import Relighter
from srbf.sphere import random_directions

SAME = 1e-5  # of the largest value: the contract of the shaders, of float32 sums of a few dozen products
SUN = DirectionalLight((0.3, 0.2, 0.9), (1, 0.5, 0.2))
POINT = PointLight((0.2, 0.1, 0.7), (0.4, 1, 0.3), a0=0.8)
SPOT = SpotLight((0, -0.5, 1), (1, 1, 0.5), direction=(0, 0.5, -1), inner=0.2, outer=0.7)
ENVIRONMENT = EnvironmentLight(np.random.default_rng(0).random((8, 16, 3)).astype(np.float32))
EVERY: list[Light] = [SUN, POINT, ENVIRONMENT, SPOT]
MANY: list[Light] = [DirectionalLight(tuple(d), tuple(abs(d))) for d in random_directions(37, "hemisphere", np.random.default_rng(4))]
POINTS: list[Light] = [PointLight(tuple(d), tuple(abs(d))) for d in random_directions(11, "hemisphere", np.random.default_rng(5))]


@pytest.mark.parametrize(
    ("encoding", "lights"),
    [
        *[("float", lights) for lights in ([SUN], [POINT], [SPOT], [ENVIRONMENT], EVERY, MANY, POINTS)],
        *[(encoding, EVERY) for encoding in ("uint8", "half")],
    ],
    ids=lambda value: value if isinstance(value, str) else f"{len(value)}{value[0].__class__.__name__}",
)
def test_equals_numpy(context: Any, encoding: Encoding, lights: list[Light]) -> None:
    asset = build_neural(9, 8, encoding)
    expected = relight(asset, lights)
    with Relighter(asset, context=context) as relighter:
        found = relighter.relight(lights)
    np.testing.assert_allclose(found, expected, atol=SAME * len(lights) * np.abs(expected).max())
    assert np.abs(expected - asset.images["ambient"]).max() > 0.1


def test_frames_do_not_leak_into_each_other_and_no_light_is_ambient(context: Any) -> None:
    asset = build_neural()
    with Relighter(asset, context=context) as relighter:
        first = relighter.relight([SUN, POINT])
        np.testing.assert_array_equal(relighter.relight([]), asset.images["ambient"])
        np.testing.assert_array_equal(relighter.relight([SUN, POINT]), first)


def test_what_no_pass_can_do_is_refused(context: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    asset = build_neural()
    del asset.images["position"]
    with Relighter(asset, context=context) as relighter, pytest.raises(InputError, match="need a position map"):
        relighter.relight([POINT])
    few = Limits.of(context)
    monkeypatch.setattr(Limits, "of", lambda context: few.__class__(**{**few.__dict__, "fragment_vectors": 64}))
    with pytest.raises(ShaderError, match="expected a network of this GPU's 32 vectors of uniforms, found .*; fit a smaller one"):
        Relighter(asset, context=context)


def test_a_network_of_the_usual_size_equals_numpy(context: Any) -> None:
    asset = build_neural(12, 20)
    with Relighter(asset, context=context) as relighter:
        found = relighter.relight([SUN])
    expected = relight(asset, [SUN])
    np.testing.assert_allclose(found, expected, atol=SAME * np.abs(expected).max())
