"""The camera of a view, found from where its pixels lie."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from view_assets import EYE, LENS, ROTATION, seen_room

from srbf.asset import Asset
from srbf.viewer.camera import fitted_camera


@pytest.mark.parametrize("outliers", [0.0, 0.03])
def test_a_pinhole_camera_is_found_again(make_asset: Callable[..., Asset], outliers: float) -> None:
    """From positions in single precision; some pixels straddle an edge, and say a place between."""
    asset = seen_room(make_asset(k=3, height=48, width=64))
    rng = np.random.default_rng(2)
    straddling = rng.random((48, 64)) < outliers
    asset.images["position"][straddling] += rng.normal(scale=0.5, size=(int(straddling.sum()), 3)).astype(np.float32)
    camera = fitted_camera(asset)
    assert camera is not None
    assert camera.rms < 0.05
    assert np.abs(camera.position - EYE).max() < 1e-3
    assert np.abs(camera.rotation - ROTATION).max() < 1e-3
    assert np.abs(camera.lens - LENS).max() < 1e-3


def test_an_asset_that_was_moved_is_seen_from_where_it_is(make_asset: Callable[..., Asset]) -> None:
    asset = seen_room(make_asset(k=3, height=48, width=64))
    move = np.eye(4)
    move[:3, 3] = 0.5, -2.0, 1.0
    asset.manifest["asset_from_world"] = move.tolist()
    camera = fitted_camera(asset)
    assert camera is not None
    assert np.abs(camera.position - (EYE - move[:3, 3])).max() < 1e-3


def test_where_no_camera_is_to_be_found_none_is(make_asset: Callable[..., Asset]) -> None:
    room = seen_room(make_asset(k=3, height=48, width=64))
    flat = seen_room(make_asset(k=3, height=48, width=64))
    flat.images["position"][..., 2] = 0
    scattered = make_asset(k=3, height=48, width=64)
    without = make_asset(k=3, position=False)
    assert fitted_camera(room) is not None
    for asset in (flat, scattered, without):
        assert fitted_camera(asset) is None
