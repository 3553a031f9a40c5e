"""three.js with WebGL2, in a browser: the pixels of every method under every kind of light are numpy's."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from web_assets import LIGHTS, complete, tolerance

from srbf.asset import Asset
from srbf.methods import relight

ENCODINGS = ("float", "half", "uint8")


@pytest.fixture(scope="module")
def served(browser: Any, make_asset: Callable[..., Asset], make_planes: Callable[..., Asset]) -> dict[tuple[str, str], tuple[Asset, str]]:
    """(asset, URL) by method and encoding."""
    out = {}
    for encoding in ENCODINGS:
        for asset in (
            make_asset(k=7, encoding=encoding, ambient=True),
            make_planes(scalars=9, encoding=encoding, ambient=True),
            make_planes(scalars=5, clusters=7, encoding=encoding),
        ):
            ready = complete(asset)
            out[ready.method, encoding] = ready, browser.serve(ready)
    return out


@pytest.mark.parametrize("kind", LIGHTS)
@pytest.mark.parametrize("method", ["relighting-map", "eigen-map", "clustered-eigen-map"])
def test_the_lightmap_that_three_draws_is_numpys(browser: Any, served: dict, method: str, kind: str) -> None:
    for encoding in ENCODINGS:
        asset, url = served[method, encoding]
        expected = relight(asset, LIGHTS[kind])
        for target in ("float", "half"):
            drawn = browser.picture("three-lightmap", asset=url, lights=LIGHTS[kind], target=target)
            error = np.abs(drawn - expected) / tolerance(asset, LIGHTS[kind], target)
            print(method, kind, encoding, target, error.max())
            assert error.max() <= 1
