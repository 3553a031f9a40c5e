"""Layers whose mean has no meaning, in the materials of Babylon.js and PlayCanvas: each texel is relit by itself."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from made_assets import build_neural
from web_assets import ALBEDO, FLOAT, HALF_EXTENT, LIGHTS, PLACE, complete, on_a_plane, tolerance

from srbf.asset import Asset
from srbf.methods import relight


@pytest.mark.parametrize("engine", ["babylon", "playcanvas"])
@pytest.mark.parametrize("filtering", ["nearest", "linear"])
@pytest.mark.parametrize(
    ("method", "kind"), [("clustered-eigen-map", "directional"), ("clustered-eigen-map", "several"), ("neural-map", "several")]
)
def test_each_texel_has_its_own_functions_or_code(
    browser: Any, make_planes: Callable[..., Asset], engine: str, method: str, kind: str, filtering: str
) -> None:
    """Filtered, the light of four texels is mixed, which in the middle of each is its own."""
    made = build_neural() if method == "neural-map" else make_planes(components=5, clusters=7, encoding="half", ambient=True)
    asset = complete(on_a_plane(made))
    job = {"asset": browser.serve(asset), "lights": LIGHTS[kind], "color": ALBEDO, "half": HALF_EXTENT, "filter": filtering}
    shown = browser.picture(f"{engine}-material", **job) * np.pi / ALBEDO
    allowed = tolerance(asset, LIGHTS[kind])
    if filtering == "linear":
        allowed = allowed + PLACE * allowed.max() / FLOAT
    assert (np.abs(shown - relight(asset, LIGHTS[kind])) <= allowed).all()
