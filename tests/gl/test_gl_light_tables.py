"""Named lights and lights inside the scene by shaders: the pictures of numpy, at the cost of one distant light."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from made_names import NAMES, capture_of_names, smooth_images
from made_rooms import Room, room_of_patches

from srbf.asset import Asset
from srbf.lights import AreaLight, Light, NamedLight, PointLight, SpotLight
from srbf.methods import relight
from srbf.methods.light_cloud import LightCloud
from srbf.methods.light_mix import LightMix
from srbf.methods.named_maps import NamedMaps
from srbf.relighting.relighter import Relighter

pytest.importorskip("moderngl")
pytest.importorskip("sklearn")
FLOAT = 1e-5  # of the picture's largest value, on float targets

MIX: list[Light] = [NamedLight(name, (0.3 + 0.2 * i, 1.0, 0.5)) for i, name in enumerate(NAMES)]
INSIDE: list[Light] = [
    PointLight((1.5, 1.0, 1.0), (1.0, 0.8, 0.6), falloff="inverse-square"),
    SpotLight((1.0, 1.0, 1.5), falloff="inverse-square", direction=(0.2, 0, -1), inner=0.4, outer=0.7),
    AreaLight((2.0, 1.0, 1.9), u=(0.3, 0, 0), v=(0, -0.3, 0)),
]


@pytest.fixture(scope="module", params=["light-mix", "light-mix of one cluster", "named-maps", "light-cloud"])
def lit(request, tmp_path_factory) -> tuple[Asset, list[Light]]:
    folder: Path = tmp_path_factory.mktemp("lit") / "capture"
    if request.param == "light-cloud":
        pytest.importorskip("embreex")
        room = Room.box((3, 2, 2), 0.5, 0.6)
        return LightCloud(clusters=4, components=8).encode(room_of_patches(folder, room, 40, tested=1)), INSIDE
    capture = capture_of_names(folder, smooth_images(len(NAMES), 12, 12))
    method = {"light-mix": LightMix(3, 6), "light-mix of one cluster": LightMix(1, 9), "named-maps": NamedMaps()}[request.param]
    return method.encode(capture), MIX


@pytest.mark.lengthy
@pytest.mark.parametrize("multipass", [False, True])
def test_shaders_show_what_numpy_does(lit: tuple[Asset, list[Light]], multipass: bool) -> None:
    asset, lights = lit
    expected = relight(asset, lights)
    with Relighter(asset) as relighter:
        shown = relighter.relight(lights, multipass=multipass)
        dark = relighter.relight([])
    np.testing.assert_allclose(shown, expected, atol=FLOAT * expected.max())
    assert not dark.any()
