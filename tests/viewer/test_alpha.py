"""A view on an empty background ends in the page's own, its edges mixed by coverage; a saved picture is transparent there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_assets import build_asset
from web_assets import complete, on_a_plane

from srbf.asset import Asset
from srbf.cli.light_arguments import read_frames
from srbf.io import files
from srbf.io.image import decode_srgb, encode_srgb, read_image
from srbf.lights import DirectionalLight, Light
from srbf.methods import linear_response, relight
from srbf.viewer.site import write as write_site

SIZE, ZOOM = 14, 16
VIEW = f"#{{'zoom':{ZOOM},'middle':[7,7],'exposure':-1}}"
BACKGROUND = np.array([0x0F, 0x11, 0x14]) / 255
STEP = 1.02  # bytes: rounding, half floats of the coverage


def ball() -> Asset:
    """A view of a disc whose edge covers its pixels in part; outside, the maps hold bright values that nobody may see."""
    y, x = np.mgrid[:SIZE, :SIZE] - (SIZE - 1) / 2
    share = np.clip(5.2 - np.hypot(x, y), 0, 1).astype(np.float32)
    made = build_asset(
        k=5, height=SIZE, width=SIZE, coefficients=np.abs(np.random.default_rng(3).normal(size=(5, SIZE, SIZE, 3))).astype(np.float32)
    )
    plane = on_a_plane(made)
    asset = replace(plane, images={**plane.images, "coverage": share})
    assert ((share > 0) & (share < 1)).sum() > 10 and (share == 0).sum() > 80
    return complete(asset, source={"receiver": {"kind": "view", "camera": "Camera"}})


def lights_of(chromium: Any, folder: Path) -> list[Light]:
    (folder / "FRAMES.json").write_bytes(chromium.file("Lights (FRAMES.json)"))
    return read_frames(folder / "FRAMES.json")[0]


def expected(image: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Bytes of the picture over the page's background, mixed as light is."""
    color = np.clip(image * 0.5, 0, 1)
    return encode_srgb(color * share[..., None] + decode_srgb(BACKGROUND) * (1 - share[..., None])) * 255


@pytest.mark.parametrize("site", [False, True])
def test_outside_a_view_is_the_background(chromium: Any, serve: Callable, serve_static: Callable, tmp_path: Path, site: bool) -> None:
    asset = ball()
    asset.save(tmp_path / "asset")
    if site:
        (tmp_path / "site").mkdir()
        write_site(asset, tmp_path / "site")
        url = serve_static(tmp_path / "site")
    else:
        url = serve(tmp_path / "asset")
    chromium("open", url=url + VIEW, width=800, height=520)
    share, relit = asset.images["coverage"], relight(asset, lights_of(chromium, tmp_path))
    assert relit[share == 0].max() > 0.5  # streaks, were they shown
    shown = chromium.texels(SIZE, SIZE, ZOOM)
    assert np.abs(shown - expected(relit, share)).max() <= STEP
    assert (shown[share == 0] == np.round(BACKGROUND * 255)).all()
    (tmp_path / "saved.png").write_bytes(chromium.file("Picture (PNG)"))
    saved = read_image(tmp_path / "saved.png")
    assert saved.shape == (SIZE, SIZE, 4) and not saved[share == 0].any()
    assert np.abs(saved[..., 3] - share).max() * 255 <= STEP
    straight = encode_srgb(np.clip(relit * 0.5, 0, 1))
    assert np.abs(saved[share > 0, :3] - straight[share > 0]).max() * 255 <= STEP


def test_the_captures_own_picture_is_cut_out_alike(chromium: Any, make_capture: Callable, serve: Callable, tmp_path: Path) -> None:
    asset = ball()
    share = asset.images["coverage"]

    def response(direction: np.ndarray) -> np.ndarray:
        return np.maximum(linear_response(asset, [DirectionalLight(tuple(direction))]), 0)

    capture = make_capture(response, lights=12, holdout=0, coverage=share, position=asset.images["position"])
    files.write_json(capture.folder / "capture.json", {**capture.manifest, "receiver": {"kind": "view", "camera": "Camera"}})
    asset.save(tmp_path / "asset")
    url = serve(tmp_path / "asset", capture.folder)
    chromium("open", url=url + VIEW.replace("'exposure'", "'compare':'reference','exposure'"), width=800, height=520)
    shown = chromium.texels(SIZE, SIZE, ZOOM)
    assert (shown[share == 0] == np.round(BACKGROUND * 255)).all()
    (sun,) = lights_of(chromium, tmp_path)
    assert isinstance(sun, DirectionalLight)
    image = capture.image(int(np.argmax(capture.directions(range(12)) @ sun.direction)))
    assert np.abs(shown - expected(image, share)).max() <= STEP


def test_a_lightmap_is_a_texture_and_shows_what_fills_its_gutter(chromium: Any, serve: Callable, tmp_path: Path) -> None:
    asset = complete(ball(), source={"receiver": {"kind": "lightmap", "object": "Plane"}})
    asset.save(tmp_path / "asset")
    chromium("open", url=serve(tmp_path / "asset") + VIEW.replace("'zoom'", "'view':'texels','zoom'"), width=800, height=520)
    whole = np.ones((SIZE, SIZE), np.float32)
    assert np.abs(chromium.texels(SIZE, SIZE, ZOOM) - expected(relight(asset, lights_of(chromium, tmp_path)), whole)).max() <= STEP
