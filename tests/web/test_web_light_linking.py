"""Light linking of deep framebuffers on the web: light on some objects, shadows of some, as numpy has them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from made_rooms import Room
from made_views import view_of_room
from test_web_deep_framebuffer import CLOSE, LIGHTS, RIM, RUNS, told
from view_assets import with_objects

from srbf import methods
from srbf.asset import Asset
from srbf.light_linking import Objects
from srbf.lights import DirectionalLight
from srbf.methods.deep_framebuffer import DeepFramebuffer

pytest.importorskip("embreex")

WALL = 1.5  # m: where it stands
THROUGH_WALL, NO_SHADOW = Objects(without=("Wall",)), Objects(only=())
KINDS: dict[str, Any] = dict(LIGHTS)
LINKED: list[Any] = [
    replace(KINDS["point"], receivers=Objects(only=("Red",))),
    replace(KINDS["point"], blockers=THROUGH_WALL),
    replace(KINDS["spot"], receivers=Objects(without=("Red", "Wall"))),
    replace(KINDS["area"], receivers=Objects(only=("Gray", "Red")), blockers=THROUGH_WALL),
    replace(KINDS["directional"], receivers=Objects(only=("Gray", "Wall"), without=("Gray",)), blockers=NO_SHADOW),
]


@pytest.fixture(scope="module")
def asset(tmp_path_factory: pytest.TempPathFactory) -> Asset:
    """Of many surfels, with a wall across that has a door."""
    room = Room.box((3, 2, 2), 0.25, 0.6, wall=(WALL, 0.6, 1.4), lid=False)
    view = view_of_room(tmp_path_factory.mktemp("view") / "capture", room, 8000, 150, tested=0)
    return with_objects(DeepFramebuffer().encode(view), room, WALL)


@pytest.mark.parametrize("run", RUNS, ids=lambda run: "-".join(run.values()))
def test_lights_shine_on_what_they_choose(browser: Any, asset: Asset, run: dict[str, str]) -> None:
    """One after the other, all together, and after these a light that chooses nothing."""
    sets = [*[[light] for light in LINKED], LINKED, [LIGHTS["point"]]]
    drawn = browser.lightmaps(asset=browser.serve(asset), light_sets=[told(*lights) for lights in sets], **run)
    for picture, lights in zip(drawn, sets, strict=True):
        expected = methods.relight(asset, lights)
        plain = methods.relight(asset, [replace(light, receivers=None, blockers=None) for light in lights])
        assert lights == [LIGHTS["point"]] or np.abs(plain - expected).max() > 10 * CLOSE * expected.max(), lights
        tolerance = RIM if any(isinstance(light, DirectionalLight) for light in lights) else CLOSE
        np.testing.assert_allclose(picture, expected, atol=tolerance * expected.max(), err_msg=str(lights))


def test_names_that_the_scene_lacks_are_refused(browser: Any, asset: Asset) -> None:
    light = replace(KINDS["point"], blockers=Objects(only=("Vase",)))
    for run in (RUNS[0], RUNS[1]):
        response = browser.response(asset=browser.serve(asset), lightSets=[told(light)], **run)
        assert 'among a light\'s blockers, found "Vase"; it has "Gray", "Red", "Wall"' in response["error"]
