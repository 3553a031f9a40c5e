"""three.js' nodes, in a browser, on WebGPU and on WebGL2: the pixels of every method are numpy's."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from web_assets import FOLLOWED, HALF_EXTENT, LIGHTS, complete, on_a_plane, tolerance

from srbf.asset import Asset
from srbf.methods import relight

BACKENDS = ("webgl", "webgpu")
METHODS = ("relighting-map", "eigen-map", "clustered-eigen-map")
ALBEDO = (0.8, 0.5, 0.3)


@pytest.fixture(scope="module")
def served(browser: Any, make_asset: Callable[..., Asset], make_planes: Callable[..., Asset]) -> dict[str, tuple[Asset, str]]:
    """(asset, URL) by method."""
    made = [make_asset(k=7, encoding="half", ambient=True), make_planes(scalars=9, encoding="uint8"), make_planes(scalars=5, clusters=7)]
    ready = [complete(on_a_plane(asset)) for asset in made]
    return {asset.method: (asset, browser.serve(asset)) for asset in ready}


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("method", METHODS)
def test_the_lightmap_that_nodes_draw_is_numpys(browser: Any, served: dict, method: str, backend: str) -> None:
    asset, url = served[method]
    for kind, lights in LIGHTS.items():
        for target in ("float", "half") if kind == "several" else ("float",):
            drawn = browser.picture("nodes-lightmap", asset=url, lights=lights, target=target, backend=backend)
            error = np.abs(drawn - relight(asset, lights)) / tolerance(asset, lights, target)
            print(method, backend, kind, target, error.max())
            assert error.max() <= 1, (kind, target)
