"""What the node group emits, rendered by Cycles, is the library's picture."""

from __future__ import annotations

import json

import numpy as np
import pytest

from srbf.basis.gaussian import TABLE_TOLERANCE
from srbf.lights import DirectionalLight, PointLight
from srbf.methods import relight

pytestmark = pytest.mark.blender

# The library looks R up in its table, the nodes compute it: off by TABLE_TOLERANCE of each |c_i| times the light. The maps are the same.
FLOAT32 = 2e-5  # relative to the same sum: a k-term sum, arccosine and exponential in Cycles' single precision
TEXEL = 2e-3  # of the step to a neighbor: Cycles' first sample lies within 0.001 texel of the center, along either axis
SUN = {"kind": "SUN", "name": "Sun", "energy": 2.0, "color": [1.0, 0.5, 0.25], "location": [0, 0, 0], "axis": [0.4, -0.3, 0.8]}
SECOND = {"kind": "SUN", "name": "Fill", "energy": 0.5, "color": [0.1, 0.2, 0.9], "location": [0, 0, 5], "axis": [-0.7, 0.1, 0.3]}
POINT = {"kind": "POINT", "name": "Bulb", "energy": 30.0, "color": [1.0, 0.8, 0.6], "location": [0.3, -0.4, 0.7]}
LOW = {"kind": "POINT", "name": "Candle", "energy": 4.0, "color": [0.9, 0.3, 0.1], "location": [-0.8, 0.5, 0.2]}


def light_of(point_light, a0=1.0, falloff="inverse-square"):
    if point_light["kind"] == "SUN":
        return DirectionalLight(tuple(point_light["axis"]), tuple(point_light["energy"] * c for c in point_light["color"]))
    color = tuple(point_light["energy"] / (4 * np.pi * a0**2) * c for c in point_light["color"])
    return PointLight(tuple(point_light["location"]), color, a0, falloff)


def tolerance(asset, lights):
    """(H, W, 3): the tolerances above, for this asset and these lights."""
    size = np.abs(asset.coefficients()).sum(axis=0)
    strength = np.zeros((asset.height, asset.width, 3))
    for light in lights:
        near = 1.0
        if isinstance(light, PointLight):
            distance = np.linalg.norm(np.array(light.position) - asset.images["position"], axis=2, keepdims=True)
            near = (light.a0 / distance) ** (1 if light.falloff == "linear" else 2)
        strength += near * np.array(light.color)
    picture = relight(asset, lights)
    return (TABLE_TOLERANCE + FLOAT32) * size * strength + TEXEL * largest_step(picture) + 1e-6


def largest_step(picture):
    """The largest difference to one of the four neighbors, (H, W, 3)."""
    step = np.zeros_like(picture)
    for axis in (0, 1):
        difference = np.abs(np.diff(picture, axis=axis))
        pads = [[(0, 0)] * 3, [(0, 0)] * 3]
        pads[0][axis], pads[1][axis] = (0, 1), (1, 0)
        for pad in pads:
            step = np.maximum(step, np.pad(difference, pad))
    return step


@pytest.fixture
def emitted(in_blender, tmp_path):
    def render(asset, point_lights, name="asset", **case):
        out = tmp_path / "emitted.npy"
        response = in_blender(
            "relit", asset=str(tmp_path / name), lights=point_lights, out=str(out), width=asset.width, height=asset.height, **case
        )
        return np.load(out), response

    return render


@pytest.mark.parametrize("layout", ["IMAGES", "ATLAS"])
@pytest.mark.parametrize("encoding", ["half", "uint8"])
def test_suns_as_numpy_has_them(make_asset, emitted, layout, encoding) -> None:
    asset = make_asset(encoding=encoding)
    found, _ = emitted(asset, [SUN, SECOND], layout=layout)
    lights = [light_of(SUN), light_of(SECOND)]
    expected = relight(asset, lights)
    assert (np.abs(found - expected) <= tolerance(asset, lights)).all()
    assert (expected > asset.images["ambient"]).any()
    assert (expected == asset.images["ambient"]).any()  # the clamp has something to do, in some texels


@pytest.mark.parametrize(("falloff", "a0"), [("inverse-square", 1.0), ("linear", 0.5)])
def test_point_lights_as_numpy_has_them(make_asset, emitted, falloff, a0) -> None:
    asset = make_asset()
    found, _ = emitted(asset, [POINT, LOW, SUN], falloff=falloff.upper().replace("-", "_"), a0=a0)
    lights = [light_of(point_light, a0, falloff) for point_light in (POINT, LOW, SUN)]
    assert (np.abs(found - relight(asset, lights)) <= tolerance(asset, lights)).all()


def test_albedo_over_pi(make_asset, emitted) -> None:
    asset = make_asset(ambient=False)
    color = np.array([0.8, 0.5, 0.1])
    found, response = emitted(asset, [SUN], albedo=[color.tolist()])
    lights = [light_of(SUN)]
    assert (np.abs(found * np.pi / color - relight(asset, lights)) <= tolerance(asset, lights)).all()
    assert response["notes"] == []


def test_lights_that_come_later(make_asset, emitted) -> None:
    """A point light and a sun added after Show: the handler updates the weights, and adds nodes for the point light."""
    asset = make_asset()
    spot = {**POINT, "kind": "SPOT", "name": "Spot"}
    found, response = emitted(asset, [SUN, spot], later=[SECOND, POINT])
    lights = [light_of(point_light) for point_light in (SUN, SECOND, POINT)]
    assert (np.abs(found - relight(asset, lights)) <= tolerance(asset, lights)).all()
    assert response["notes"] == ["not shown: light of Spot (only suns and point lights are)"]


def test_a_layer_that_the_bake_made(make_asset, emitted, tmp_path) -> None:
    receiver = {"kind": "lightmap", "object": "Plane", "uv_layer": "srbf lightmap"}
    asset = make_asset(source={"receiver": receiver})
    turned = [[1, 1], [0, 1], [0, 0], [1, 0]]  # the plane's corners, half a turn on
    (tmp_path / "capture").mkdir()
    (tmp_path / "capture" / "uv.json").write_text(json.dumps({"uv_layer": "srbf lightmap", "per_loop": turned}))
    found, _ = emitted(asset, [SUN], capture=str(tmp_path / "capture"), layer="other")
    lights = [light_of(SUN)]
    # what is emitted is baked into the plane's own active layer: there the picture is upside down
    assert (np.abs(found[::-1, ::-1] - relight(asset, lights)) <= tolerance(asset, lights)).all()


@pytest.mark.parametrize(("layout", "warned"), [("IMAGES", True), ("ATLAS", False)])
def test_many_maps_in_eevee_are_warned_of(make_asset, emitted, layout, warned) -> None:
    asset = make_asset(k=20, size=(4, 4))
    _, response = emitted(asset, [SUN], layout=layout, engine="BLENDER_EEVEE_NEXT")
    assert [("Atlas" in note) for note in response["notes"]] == [True] * warned
