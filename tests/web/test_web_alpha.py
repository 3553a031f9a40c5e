"""A view that does not fill its picture, in every web engine: each pixel is its color times its coverage, once, before what lies behind."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from web_assets import HALF_EXTENT, LIGHTS, complete, on_a_plane, tolerance

from srbf.asset import Asset
from srbf.methods import relight

ENGINES = {
    "three-material": {"material": "MeshBasicMaterial", "source": "maps"},
    "nodes-material": {"material": "MeshBasicMaterial", "source": "maps", "backend": "webgl"},
    "babylon-material": {"rightHanded": True},
    "playcanvas-material": {},
}
CLEARED = {"babylon-material": (0.2, 0.2, 0.3), "playcanvas-material": (0.75, 0.75, 0.75)}  # by default; three.js: black
HALF = 2.0**-11
BYTE = 0.5 / 255


@pytest.fixture(scope="module")
def view(make_asset: Callable[..., Asset]) -> Asset:
    plane = on_a_plane(make_asset(k=5, encoding="half"))
    share = np.clip(np.random.default_rng(2).uniform(-0.5, 1.5, (plane.height, plane.width)), 0, 1).astype(np.float32)
    made = complete(replace(plane, images={**plane.images, "coverage": share}), quantity="radiance")
    return replace(made, manifest={**made.manifest, "source": {"receiver": {"kind": "view", "camera": "Camera"}}})


@pytest.mark.parametrize("engine", ENGINES)
def test_a_view_is_cut_out_by_its_coverage(browser: Any, view: Asset, engine: str) -> None:
    share = view.images["coverage"]
    assert (share == 0).any() and (share == 1).any() and ((share > 0) & (share < 1)).any()
    job = {"asset": browser.serve(view), "lights": LIGHTS["several"], "color": (1, 1, 1), "half": HALF_EXTENT, **ENGINES[engine]}
    shown = browser.picture(engine, **job)
    relit = relight(view, LIGHTS["several"])
    assert relit[share == 0].max() > 0.1  # what would be seen of the outside
    step = BYTE if engine.startswith(("babylon", "playcanvas")) else HALF
    behind = np.float32(CLEARED.get(engine, (0, 0, 0)))
    error = np.abs(shown - relit * share[..., None] - behind * (1 - share[..., None]))
    assert (error <= tolerance(view, LIGHTS["several"]) + step * (np.abs(relit) + behind)).all(), error.max()


def test_the_lightmap_pass_keeps_the_coverage_as_alpha_only_of_pictures(browser: Any, view: Asset) -> None:
    lightmap = replace(view, manifest={**view.manifest, "source": {"receivers": [{"kind": "lightmap", "object": "A"}]}})
    for asset in (view, lightmap):
        shown = browser.lightmaps("three-lightmap", browser.serve(asset), [LIGHTS["directional"]])[0]
        assert (np.abs(shown - relight(asset, LIGHTS["directional"])) <= tolerance(asset, LIGHTS["directional"])).all()
    job = {"lights": LIGHTS["several"], "color": (1, 1, 1), "half": HALF_EXTENT, **ENGINES["three-material"]}
    shown = browser.picture("three-material", asset=browser.serve(lightmap), **job)
    assert (np.abs(shown - relight(lightmap, LIGHTS["several"])) <= tolerance(lightmap, LIGHTS["several"])).all()
