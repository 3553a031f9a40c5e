"""Babylon.js, in a browser: a PBR material shows what numpy says of the asset."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from made_assets import build_neural
from web_assets import ALBEDO, FLOAT, HALF_EXTENT, LIGHTS, PLACE, complete, on_a_plane, tolerance

from srbf.asset import Asset
from srbf.methods import linear_response, relight

BRIGHTEST = 30.0  # Babylon.js clamps what a PBR material hands to post-processes


@pytest.mark.parametrize(("kind", "right_handed"), [("directional", True), ("point", False), ("several", True)])
def test_a_pbr_material_shows_albedo_times_irradiance_over_pi(
    browser: Any, make_asset: Callable[..., Asset], kind: str, right_handed: bool
) -> None:
    """In either handedness of the scene, receivers from the vertex stage."""
    asset = complete(on_a_plane(make_asset(k=7, encoding="half", ambient=True)))
    job = {"asset": browser.serve(asset), "lights": LIGHTS[kind], "color": ALBEDO, "half": HALF_EXTENT, "rightHanded": right_handed}
    shown = browser.picture("babylon-material", **job) * np.pi / ALBEDO
    assert (np.abs(shown - relight(asset, LIGHTS[kind])) <= tolerance(asset, LIGHTS[kind])).all()


def test_eigen_maps_and_radiance_work_too(browser: Any, make_planes: Callable[..., Asset]) -> None:
    asset = complete(make_planes(components=6, encoding="uint8"), quantity="radiance", receiver={"kind": "view"})
    asset.images["coverage"][:] = 1
    job = {"lights": LIGHTS["several"], "color": ALBEDO, "half": HALF_EXTENT}
    shown = browser.picture("babylon-material", asset=browser.serve(asset), **job)
    expected = np.minimum(relight(asset, LIGHTS["several"]), BRIGHTEST)
    assert (np.abs(shown - expected) <= tolerance(asset, LIGHTS["several"])).all()


def test_a_neural_map_between_texels_is_the_mix_of_their_light(browser: Any) -> None:
    """0.25 texels to the right and 0.5 down, edges clamped."""
    asset = complete(on_a_plane(build_neural()))
    del asset.images["ambient"], asset.manifest["ambient"]
    right, down = 0.25, 0.5
    u, v = right / asset.width, down / asset.height
    job = {
        "lights": LIGHTS["directional"],
        "color": ALBEDO,
        "half": HALF_EXTENT,
        "filter": "linear",
        "uvs": [u, v, 1 + u, v, u, 1 + v, 1 + u, 1 + v],
    }
    shown = browser.picture("babylon-material", asset=browser.serve(asset), **job) * np.pi / ALBEDO
    texels = linear_response(asset, LIGHTS["directional"])
    rows = (1 - down) * texels + down * np.vstack([texels[1:], texels[-1:]])
    mixed = (1 - right) * rows + right * np.hstack([rows[:, 1:], rows[:, -1:]])
    allowed = tolerance(asset, LIGHTS["directional"])
    assert (np.abs(shown - np.maximum(mixed, 0)) <= allowed + PLACE * allowed.max() / FLOAT).all()
    assert (np.abs(np.maximum(texels, 0) - np.maximum(mixed, 0)) > 1000 * allowed).any()
