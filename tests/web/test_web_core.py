"""The engine-free core: its arithmetic is numpy's to the last bits, its decoders give back what was written."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from made_assets import build_neural
from web_assets import LIGHTS, complete

from srbf.asset import Asset
from srbf.export import Settings, export
from srbf.gl.uniforms import point_light_uniforms
from srbf.light_domain.distant_lights import distant_lights
from srbf.lights import DirectionalLight, PointLight, moved
from srbf.methods import projected_weights

DOUBLE = 1e-11  # relative: the same double-precision arithmetic in another order
SINGLE = 1e-6  # of the largest weight: numpy sums light functions in single precision
ENCODINGS = ("float", "half", "uint8")
ARRAYS = [("dds", "bc7"), ("dds", "half"), ("ktx2", "bc7"), ("ktx2", "bc1"), ("ktx2", "uint8")]


def moving() -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3] = 1.3 * np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, 0.28, -0.96], [0, 0.96, 0.28]])
    matrix[:3, 3] = 0.3, -0.2, 1e4
    return matrix


@pytest.mark.parametrize("still", [True, False])
@pytest.mark.parametrize("method", ["relighting-map", "eigen-map", "clustered-eigen-map"])
def test_weights_and_point_lights_are_numpys(browser: Any, make_asset: Callable, make_planes: Callable, method: str, still: bool) -> None:
    made = {
        "relighting-map": lambda: make_asset(k=25),
        "eigen-map": lambda: make_planes(components=9),
        "clustered-eigen-map": lambda: make_planes(components=5, clusters=7),
    }
    asset = complete(made[method](), asset_from_world=(np.eye(4) if still else moving()).tolist())
    url = browser.serve(asset)
    for kind, lights in LIGHTS.items():
        said = browser.response("host", asset=url, lights=lights)
        expected = projected_weights(Asset.open(browser.folder(url)), lights)
        within = DOUBLE if method == "relighting-map" else SINGLE
        most = max(np.abs(expected).max(), 1)
        np.testing.assert_allclose(np.reshape(said["weights"], (-1, 3)), expected, rtol=within, atol=within * most, err_msg=kind)
        point_lights = [point_light_uniforms(moved(light, asset.asset_from_world)) for light in lights if isinstance(light, PointLight)]
        assert len(said["pointLights"]) == len(point_lights)
        for found, point_light in zip(said["pointLights"], point_lights, strict=True):
            assert found.keys() == point_light.keys()
            place = [np.add(one["position"], one["positionLow"]) for one in (found, point_light)]  # either sum may be split at another bit
            np.testing.assert_allclose(place[0], place[1], rtol=1e-10)
            for name in point_light.keys() - {"position", "positionLow"}:
                np.testing.assert_allclose(found[name], point_light[name], rtol=1e-12, atol=1e-15, err_msg=f"{kind} {name}")


@pytest.mark.parametrize("domain", ["sphere", "hemisphere"])
def test_a_neural_map_has_numpys_lights_at_infinity(browser: Any, domain: str) -> None:
    asset = complete(build_neural(), domain=domain)
    url = browser.serve(asset)
    for kind in ("environment", "several"):
        directions, colors = np.reshape(browser.response("host", asset=url, lights=LIGHTS[kind])["weights"], (2, -1, 3))
        expected = distant_lights(asset.manifest, LIGHTS[kind])
        count = len(expected[0])
        assert count > 20 and not directions[count:].any() and not colors[count:].any()
        np.testing.assert_allclose(directions[:count], expected[0], rtol=DOUBLE, atol=DOUBLE)
        np.testing.assert_allclose(colors[:count], expected[1], rtol=DOUBLE, atol=DOUBLE)
    said = browser.response("host", asset=url, lights=[DirectionalLight((0, 0, 1))] * 513)["error"]
    assert "expected at most 512 lights at infinity for a neural map, environments as 256, found 513" in said


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_layers_are_decoded_to_the_bit(browser: Any, make_asset: Callable, make_planes: Callable, encoding: str) -> None:
    for asset in (make_asset(k=3, encoding=encoding), make_planes(components=6, encoding=encoding)):
        said = browser.response("layers", asset=browser.serve(complete(asset)))
        found = np.array(said["levels"][0]).reshape(len(asset.stored), asset.height, asset.width, 4)[..., : asset.stored.shape[3]]
        stored = asset.stored.view(np.uint16) if encoding == "half" else asset.stored
        np.testing.assert_array_equal(found, stored)


def test_every_byte_is_kept_whatever_alpha_says(browser: Any, make_planes: Callable) -> None:
    """No color management, no multiplication by alpha: all 256 values beside alphas of 0, 1 and 255."""
    asset = complete(make_planes(components=4, encoding="uint8", height=16, width=48))
    values = np.arange(256, dtype=np.uint8).reshape(16, 16)
    for i, alpha in enumerate((0, 1, 255)):
        part = asset.stored[0, :, 16 * i : 16 * (i + 1)]
        part[..., 0], part[..., 1], part[..., 2], part[..., 3] = values, values.T, values[::-1], alpha
    said = browser.response("layers", asset=browser.serve(asset))
    np.testing.assert_array_equal(np.array(said["levels"][0]).reshape(asset.stored.shape), asset.stored)


@pytest.mark.parametrize(("target", "form"), ARRAYS)
def test_texture_arrays_are_read_level_by_level(browser: Any, make_asset: Callable, target: str, form: str) -> None:
    asset = complete(make_asset(k=3, encoding="half", height=24, width=20))
    asset.images["coverage"][:] = 1
    url = browser.place(lambda folder: export(asset, target, folder, Settings(encoding=form, levels=3)))
    said = browser.response("layers", asset=url)
    exported = Asset.open(browser.folder(url))
    assert said["encoding"] == form and len(said["levels"]) == 3
    if not form.startswith("bc"):
        found = np.array(said["levels"][0]).reshape(3, 24, 20, 4)[..., :3]
        np.testing.assert_array_equal(found, exported.stored.view(np.uint16) if form == "half" else exported.stored)


def test_damage_is_named(browser: Any, make_asset: Callable) -> None:
    url = browser.serve(complete(make_asset(k=2, encoding="half")))
    path = browser.folder(url) / "map_01.exr"
    path.write_bytes(path.read_bytes()[:-1] + b"x")
    assert "map_01.exr as it was written, found another checksum" in browser.response("load", asset=url)["error"]
    path.unlink()
    assert "map_01.exr, found status 404" in browser.response("load", asset=url)["error"]


def test_the_units_types_and_build_of_the_package_pass(npm: Callable[..., str]) -> None:
    npm("run", "check")
    npm("test")
    npm("run", "build")
