"""Light linking of direct light: what a light does not shine on is black, and what does not shadow it is not there."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from closed_forms import build_plane, from_above, quad

from srbf.arrays import Float32
from srbf.errors import InputError
from srbf.light_linking import Objects
from srbf.lights import AreaLight, DirectionalLight, Light, PointLight, SphereLight, SpotLight
from srbf.visibility import shadow_map
from srbf.visibility.rays import RayTracer
from srbf.visibility.receivers import Receivers
from srbf.visibility.shadow_map import ShadowMapper

LIGHTS: dict[str, Any] = {
    "point": PointLight((0.3, 0.1, 2.0), falloff="inverse-square"),
    "spot": SpotLight((0.3, 0.1, 2.0), direction=(-0.1, 0, -1), inner=0.4, outer=0.6, falloff="inverse-square"),
    "spot with a size": SpotLight((0.3, 0.1, 2.0), direction=(-0.1, 0, -1), inner=0.4, outer=0.6, falloff="inverse-square", size=0.1),
    "sphere": SphereLight((0.3, 0.1, 2.0), size=0.1),
    "area": AreaLight((0.3, 0.1, 2.0), u=(0.3, 0, 0), v=(0, -0.3, 0)),
    "sun": DirectionalLight((0.2, 0.1, 1), angle=0.05),
}
NAMES = ("Ground", "Roof", "Pane")
PARTS = 0.02  # of the largest: which pixels get more rays depends on what is lit
SAME = 1e-5  # of two ways of the same rays


def scene(*, panes: bool = False) -> Receivers:
    """The square [-1, 1]^2 as a view sees it from above, and a roof over the middle that the camera sees, or a pane."""
    roof = quad([-0.25, -0.25, 0.5], [0.25, -0.25, 0.5], [0.25, 0.25, 0.5], [-0.25, 0.25, 0.5])  # along borders of pixels
    camera = from_above("BOX", 1.0)
    made = build_plane(*(() if panes else (roof,)), panes=(roof,) if panes else (), albedo=(0.5, 0.5, 0.5), size=24, camera=camera)
    if not panes:
        inside = np.abs(made.images["position"][..., :2]).max(axis=2) < 0.25
        made.images["position"][inside, 2] = 0.5
    objects = np.array([0] + [2 if panes else 1] * (len(made.triangles.corners) - 1))
    return replace(made, triangles=replace(made.triangles, objects=objects, names=NAMES))


@contextmanager
def shown_by(way: str, receivers: Receivers) -> Iterator[Any]:
    if way == "ray":
        yield RayTracer(receivers)
        return
    pytest.importorskip("moderngl")
    with ShadowMapper(receivers, size=256) as mapper:
        yield mapper


@pytest.fixture(autouse=True)
def few_maps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a light with a size: which object casts or is lit is the same in each."""
    monkeypatch.setattr(shadow_map, "LOOKS", 8)
    monkeypatch.setattr(shadow_map, "SUN_SAMPLES", 4)


def on_roof(receivers: Receivers) -> np.ndarray:
    return receivers.images["position"][..., 2] > 0.25


@pytest.mark.lengthy
@pytest.mark.parametrize("way", ["ray", "shadow-map"])
def test_a_light_of_one_object_leaves_the_other_black(way: str) -> None:
    receivers = scene()
    roof = on_roof(receivers)
    with shown_by(way, receivers) as shown:
        for name, light in LIGHTS.items():
            every = shown.response([light])
            one = shown.response([replace(light, receivers=Objects(only=("Roof",)))])
            other = shown.response([replace(light, receivers=Objects(without=("Roof",)))])
            assert not one[~roof].any() and not other[roof].any(), name
            np.testing.assert_allclose(one + other, every, atol=PARTS * every.max(), err_msg=name)
            assert one[roof].max() > 0.5 * every.max() and not shown.response([replace(light, receivers=Objects(only=()))]).any()


@pytest.mark.lengthy
@pytest.mark.parametrize("way", ["ray", "shadow-map"])
def test_what_is_no_blocker_casts_no_shadow_and_is_lit(way: str) -> None:
    receivers = scene()
    roof = on_roof(receivers)
    alone = replace(receivers, triangles=replace(receivers.triangles, casts=np.zeros(3, bool)))
    with shown_by(way, receivers) as shown, shown_by(way, alone) as unshaded:
        for name, light in LIGHTS.items():
            free = shown.response([replace(light, blockers=Objects(without=("Roof",)))])
            expected, shaded = unshaded.response([light]), shown.response([light])
            np.testing.assert_allclose(free, expected, atol=2e-3 * expected.max(), err_msg=name)
            assert shaded[~roof].sum() < 0.99 * free[~roof].sum(), name
            kept = shown.response([replace(light, blockers=Objects(only=("Roof", "Ground")))])
            np.testing.assert_allclose(kept, shaded, atol=SAME * shaded.max(), err_msg=name)


@pytest.mark.lengthy
@pytest.mark.parametrize("way", ["ray", "shadow-map"])
def test_a_pane_that_is_no_blocker_tints_nothing(way: str) -> None:
    receivers, light = scene(panes=True), LIGHTS["point"]
    with shown_by(way, receivers) as shown:
        tinted, clear = shown.response([light]), shown.response([replace(light, blockers=Objects(without=("Pane",)))])
    ratio: Float32[np.ndarray, "H W 3"] = (tinted / np.maximum(clear, 1e-9)).astype(np.float32)
    assert ratio.min() == pytest.approx(0.5, abs=0.02) and ratio.max() == pytest.approx(1, abs=0.02)


def test_lights_that_choose_and_others_add_up() -> None:
    receivers = scene()
    tracer = RayTracer(receivers)
    one: Light = replace(LIGHTS["sun"], receivers=Objects(only=("Roof",)))
    both = tracer.response([one, LIGHTS["point"]])
    np.testing.assert_allclose(both, tracer.response([one]) + tracer.response([LIGHTS["point"]]), atol=SAME * both.max())


def test_triangles_without_objects_say_so() -> None:
    with pytest.raises(InputError, match="bake again"):
        RayTracer(build_plane()).response([replace(LIGHTS["point"], receivers=Objects(only=("Roof",)))])


@pytest.mark.parametrize("entry", [{"without": None}, {"only": 3}, {"only": "Cup"}, {"only": [""]}, {"without": [2]}])
def test_names_of_another_kind_are_refused(entry: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="expected names of objects"):
        Objects.of_entry(entry)
