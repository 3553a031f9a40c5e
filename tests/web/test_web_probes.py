"""What moves between probes in three.js: the light at places near walls is that of `srbf.relighting.probe_light`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cloud_assets import Room, room, with_transfer
from probe_assets import places_in, probes_of_room, write_probes
from test_web_cloud import POINT, SPOT, received

from srbf.asset import Asset
from srbf.probe_grid import ProbeGrid
from srbf.relighting.probe_light import harmonics, light_at

EXACT = 2e-5  # of the largest value, with weights from rays and float targets
HALF = 2e-3  # … with weights from shadow maps, and half floats
SETS = [[POINT], [SPOT, {**POINT, "position": (1.5, -1.0, 0.5)}]]
RUNS: dict[str, dict[str, Any]] = {
    "webgl": {"run": "three-probes"},
    "nodes-webgl": {"run": "nodes-probes", "backend": "webgl"},
    "nodes-webgpu": {"run": "nodes-probes", "backend": "webgpu"},
}


@pytest.fixture(scope="module")
def probes() -> tuple[Room, ProbeGrid]:
    return probes_of_room()


@pytest.fixture(scope="module")
def url(browser: Any, probes: tuple[Room, ProbeGrid]) -> str:
    return browser.place(lambda folder: write_probes(*probes, folder))


@pytest.fixture(scope="module")
def light(browser: Any, probes: tuple[Room, ProbeGrid], url: str) -> Callable[..., list[np.ndarray]]:
    """Irradiance at places under each of SETS, by numpy; where every probe sees everything unless `walls`."""
    made, grid = probes
    amounts = [np.sum([received(made, light) for light in lights], axis=0) for lights in SETS]
    pictures = [np.maximum(made.response(made.weights(amount)), 0).astype(np.float32) for amount in amounts]

    def at(points: np.ndarray, normals: np.ndarray, walls: bool = True) -> list[np.ndarray]:
        asset = Asset.open(Path(browser.folder(url)))
        if not walls:
            asset = replace(asset, probes=replace(grid, nearness=np.zeros_like(grid.nearness)))
        return [light_at(asset, harmonics(asset, picture), points, normals) for picture in pictures]

    return at


@pytest.mark.parametrize("name", RUNS)
def test_light_on_what_moves(
    browser: Any, probes: tuple[Room, ProbeGrid], url: str, light: Callable[..., list[np.ndarray]], name: str
) -> None:
    """Two sets of lights one after the other, set on a lightmap asset beside the probes, by the CPU and by passes of the GPU."""
    points, normals = places_in(probes[1])
    job = {
        "asset": url,
        "light_sets": SETS,
        "beside": browser.place(with_transfer(room()).write),
        "places": np.concatenate([points, normals], axis=1).tolist(),
        "half": (2, 2, 0),
        **RUNS[name],
    }
    expected, leaking = light(points, normals), light(points, normals, walls=False)
    computed = [("compute", "half", HALF)] if name == "nodes-webgpu" else []
    for weights, target, close in (("cpu", "float", EXACT), ("gpu", "half", HALF), *computed):
        pictures = browser.lightmaps(**job, weights=weights, target=target, exact=True)
        for picture, own, other in zip(pictures, expected, leaking, strict=True):
            assert np.abs(np.pi * picture[0] - own).max() < close * own.max()
            assert np.abs(other - own).max() > 0.1 * own.max(), "without walls the light is another"


def test_assets_of_other_receivers_are_refused(browser: Any) -> None:
    job = {"asset": browser.place(with_transfer(room()).write), "lightSets": [], "places": [], "half": (2, 2, 0)}
    for run in RUNS.values():
        said = browser.response(**run, beside=job["asset"], **job)["error"]
        assert "expected an asset of probes, found one of a lightmap; srbf bake --receiver probes" in said
