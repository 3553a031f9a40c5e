"""Lights inside the scene on the GPU: direct light on cells by shadow maps and the asset's tables as passes give the picture of rays."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from closed_forms import quad
from cloud_assets import Room, room, with_table, with_transfer
from test_web_cloud import FOLLOWED, LIGHTS, received

CLOSE = 2e-3  # of the largest value: half floats of the tables, and texels of a shadow map instead of rays
SUMS = 1e-5  # of the largest value: single precision, of a few hundred terms in another order
FILTERED = 5e-3  # three's comparison mixes four texels, so that a cell beside a shadow's edge is lit in part
BLOCKER = quad([-0.4, -1.5, 0], [-0.4, 0.6, 0], [-0.4, 0.6, 2.5], [-0.4, -1.5, 2.5])  # only three.js knows it
SUN = {"type": "DirectionalLight", "color": (1, 0.8, 0.5), "intensity": 2, "position": (-1.5, 2.4, -0.3), "target": (0, 0, 0)}


@pytest.fixture(scope="module")
def made() -> Room:
    return with_transfer(room())


@pytest.fixture(scope="module")
def url(browser: Any, made: Room) -> str:
    return browser.place(made.write)


def picture_of(made: Room, received: np.ndarray) -> np.ndarray:
    return np.maximum(made.response(made.weights(received)), 0)


def difference(shown: np.ndarray, expected: np.ndarray) -> float:
    assert expected.max() > 0.1
    return float(np.abs(shown - expected).max() / expected.max())


@pytest.mark.parametrize(
    ("method", "run"),
    [
        *[("transfer", {"run": "three-lightmap"}), ("light-cloud", {"run": "three-lightmap"})],
        *[("transfer", {"run": "nodes-lightmap", "backend": backend}) for backend in ("webgl", "webgpu")],
        *[(method, {"run": "nodes-lightmap", "backend": "webgpu", "weights": "compute"}) for method in ("transfer", "light-cloud")],
    ],
)
def test_passes_give_the_picture_of_rays(browser: Any, made: Room, method: str, run: dict[str, str]) -> None:
    """Every kind of light and all at once, with shadows of the asset's own triangles."""
    own = made if method == "transfer" else room()
    sets = [*LIGHTS.values()] if method == "transfer" else [LIGHTS["all"]]
    drawn = browser.lightmaps(asset=browser.place(own.write), light_sets=[*sets, []], **{"weights": "gpu", **run})
    for picture, lights in zip(drawn, sets, strict=False):
        assert difference(picture, picture_of(own, np.sum([received(own, light) for light in lights], axis=0))) < CLOSE, lights
    assert not drawn[-1].any()


@pytest.mark.parametrize(
    "run", [{"run": "three-shadows"}, *[{"run": "nodes-shadows", "backend": backend} for backend in ("webgl", "webgpu")]]
)
def test_cells_take_the_shadows_that_three_has_drawn(browser: Any, made: Room, url: str, run: dict[str, str]) -> None:
    """Of an object that the asset does not have, by all kinds of shadow maps."""
    seen = replace(made, corners=BLOCKER)
    toward = np.array([-1.5, 0.3, 2.4]) / np.linalg.norm([-1.5, 0.3, 2.4])
    sun = seen.irradiance(1e4 * toward, lambda squared, unit, least: np.ones(len(squared)))[:, None] * [2, 1.6, 1.0]
    (point, of_point), (spot, of_spot) = FOLLOWED["point"], FOLLOWED["spot"]
    cases = [
        *[("PCFShadowMap", point, received(seen, of_point)), ("BasicShadowMap", point, received(seen, of_point))],
        *[("PCFShadowMap", spot, received(seen, of_spot)), ("VSMShadowMap", spot, received(seen, of_spot))],
        *[("BasicShadowMap", SUN, sun), ("PCFShadowMap", SUN, sun)],
    ]
    job = {"half": (2.0, 1.5, 0.0), "blocker": BLOCKER.reshape(-1, 3).tolist()}
    drawn = browser.lightmaps(asset=url, light_sets=[], **run, kinds=[(kind, light) for kind, light, _ in cases], **job)
    for picture, (kind, light, expected) in zip(drawn, cases, strict=True):
        assert difference(picture, picture_of(seen, expected)) < FILTERED, (kind, light["type"])
    assert difference(drawn[0], picture_of(made, received(made, of_point))) > 10 * FILTERED, "the asset's own shadow is another"


def test_compute_shaders_add_up_long_and_short_rows(browser: Any) -> None:
    """As the passes do, to the rounding of sums: tables of fewer and of more columns than a workgroup has threads; then of WebGPU alone."""
    url = browser.place(with_transfer(room(), 150).write)
    job = {"run": "nodes-lightmap", "asset": url, "light_sets": [LIGHTS["all"], []], "backend": "webgpu"}
    passes, computed = (browser.lightmaps(weights=weights, **job) for weights in ("gpu", "compute"))
    assert difference(computed[0], passes[0]) < SUMS
    assert not computed[1].any()
    said = browser.response("nodes-lightmap", asset=url, lightSets=[[]], weights="compute", backend="webgl")["error"]
    assert 'expected WebGPU for weights "compute"' in said


def test_what_the_gpu_needs_is_named(browser: Any) -> None:
    table = with_table(room(), rays=False)[0]
    said = browser.response("three-lightmap", asset=browser.place(table.write), lightSets=[], weights="gpu")
    assert 'expected an asset of lights inside a scene, with cells.exr and scene.glb, for weights "gpu"' in said["error"]
