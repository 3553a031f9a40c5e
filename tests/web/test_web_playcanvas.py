"""PlayCanvas, in a browser: a material of an asset shows what numpy says of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from web_assets import ALBEDO, HALF_EXTENT, LIGHTS, complete, on_a_plane, tolerance

from srbf.asset import Asset
from srbf.methods import relight


@pytest.mark.parametrize("kind", ["directional", "point", "several"])
def test_a_material_shows_albedo_times_irradiance_over_pi(browser: Any, make_asset: Callable[..., Asset], kind: str) -> None:
    """Receivers from the vertex stage, the mesh's second UV set with v downwards."""
    asset = complete(on_a_plane(make_asset(k=7, encoding="half", ambient=True)))
    job = {"asset": browser.serve(asset), "lights": LIGHTS[kind], "color": ALBEDO, "half": HALF_EXTENT}
    shown = browser.picture("playcanvas-material", **job) * np.pi / ALBEDO
    assert (np.abs(shown - relight(asset, LIGHTS[kind])) <= tolerance(asset, LIGHTS[kind])).all()


def test_eigen_maps_and_radiance_work_too(browser: Any, make_planes: Callable[..., Asset]) -> None:
    asset = complete(make_planes(components=6, encoding="uint8"), quantity="radiance", receiver={"kind": "view"})
    asset.images["coverage"][:] = 1
    job = {"lights": LIGHTS["several"], "color": ALBEDO, "half": HALF_EXTENT}
    shown = browser.picture("playcanvas-material", asset=browser.serve(asset), **job)
    assert (np.abs(shown - relight(asset, LIGHTS["several"])) <= tolerance(asset, LIGHTS["several"])).all()
