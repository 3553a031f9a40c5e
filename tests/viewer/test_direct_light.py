"""Direct light on an indirect asset: in the browser what `--direct shadow-map` adds, with it, without it, or alone."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import pytest
from closed_forms import ball, build_plane, quad
from test_page import HEIGHT, WIDTH, shown_as
from view_assets import scene_glb
from web_assets import complete

from srbf.asset import Asset
from srbf.export import export
from srbf.io.image import read_image, write_image
from srbf.lights import DirectionalLight, PointLight, SpotLight
from srbf.methods import relight
from srbf.relighting.direct_light import Added

SIDE, ZOOM = 24, 16
POINT_APART, POINT_MEAN = 2.0, 2.0  # bytes: nine of ten texels; a texel at a shadow's edge is a mean of four points here
TRANSMITTANCE = np.linspace(0.2, 1.2, 24).reshape(8, 3)
MOST_APART, MEAN_APART = (
    24.0,
    0.4,
)  # bytes: at shadow edges the page samples along the position map, numpy on the triangles; drivers differ too


@pytest.fixture(params=["irradiance", "radiance"])
def split(request: pytest.FixtureRequest, make_asset: Callable[..., Asset]) -> Asset:
    """Indirect maps of a plane below a ball and two translucent panes."""
    quantity = request.param
    pane = quad([0.2, -0.9, 0.3], [0.9, -0.9, 0.5], [0.9, 0.9, 0.5], [0.2, 0.9, 0.3])
    occluder = ball(0.35, [-0.4, 0.1, 0.6], 24)
    receivers = build_plane(occluder, panes=(pane,), size=SIDE, albedo=(0.8, 0.5, 0.3) if quantity == "radiance" else None)
    plain = {"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1]}, "doubleSided": True}
    ground = quad([-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0])
    scene = scene_glb(
        ("Ground", ground, plain),
        ("Ball", occluder, plain),
        ("Pane", pane, {**plain, "extras": {"tint_by_cosine": TRANSMITTANCE.tolist()}}),
    )
    made = make_asset(k=4, height=SIDE, width=SIDE, encoding="half", position=False)
    stored = (made.stored.astype(np.float32) * 0.1).astype(np.float16)  # signed: what leaves the clamp depends on the direct light
    images = {**receivers.images, "coverage": np.ones((SIDE, SIDE), np.float32)}
    names = {"transport": "indirect", "quantity": quantity, "scene": "scene.glb", "direct": {"sun_angle": 0.05, "footprint": 0.5}}
    return complete(replace(made, stored=stored, images=images, scene=scene), **names)


def test_terms_are_the_shadow_map_s_and_the_maps(chromium: Any, split: Asset, serve: Callable[..., str], tmp_path: Path) -> None:
    split.save(tmp_path / "asset")
    lights = [DirectionalLight((-0.45, -0.5, 0.74))]
    with Added(split, "shadow-map") as added:
        direct = added.response(lights)
    expected = {"both": relight(split, lights, direct), "direct": direct, "indirect": relight(split, lights)}
    assert np.abs(expected["both"] - expected["direct"]).max() > 0.05
    url = serve(tmp_path / "asset")
    for terms, picture in expected.items():
        chromium(
            "open",
            url=f"{url}#{{'zoom':{ZOOM},'middle':[{SIDE / 2},{SIDE / 2}],'terms':'{terms}','exposure':0}}",
            width=WIDTH,
            height=HEIGHT,
        )
        apart = np.abs(chromium.texels(SIDE, SIDE, ZOOM) - shown_as(picture))
        assert (apart.max(), apart.mean()) <= (MOST_APART, MEAN_APART), terms


@pytest.mark.parametrize("kind", ["point", "spot", "wide spot"])
def test_lights_inside_the_scene_cast_shadows_as_rays_do(
    chromium: Any, split: Asset, serve: Callable[..., str], tmp_path: Path, kind: str
) -> None:
    """A point light by the faces of a cube, a spot by one map, a wide spot by a cube again: crisp, through tinted panes."""
    split.save(tmp_path / "asset")
    common = {
        "on": True,
        "color": "#ffffff",
        "intensity": 1.0,
        "position": [0.25, -0.3, 1.1],
        "a0": 1.2,
        "falloff": "inverse-square",
        "radius": 0.001,
    }
    state = {"kind": "point", **common}
    light: PointLight = PointLight((0.25, -0.3, 1.1), a0=1.2, falloff="inverse-square", radius=0.001)
    if kind != "point":
        inner, outer = (20, 40) if kind == "spot" else (50, 75)
        state |= {"kind": "spot", "target": [0.0, 0.0, 0.0], "inner": inner, "outer": outer}
        angles = {"inner": np.radians(inner), "outer": np.radians(outer)}
        light = SpotLight((0.25, -0.3, 1.1), a0=1.2, falloff="inverse-square", radius=0.001, direction=(-0.25, 0.3, -1.1), **angles)
    with Added(split, "ray") as added:
        expected = added.response([light])
    assert (expected.min(axis=2) < 0.02 * expected.max()).mean() > 0.02, "the ball's shadow"
    hashed = json.dumps({"zoom": ZOOM, "middle": [SIDE / 2, SIDE / 2], "terms": "direct", "exposure": 0, "lights": [state]})
    chromium("open", url=f"{serve(tmp_path / 'asset')}#{quote(hashed)}", width=WIDTH, height=HEIGHT)
    apart = np.abs(chromium.texels(SIDE, SIDE, ZOOM) - shown_as(expected))
    assert np.quantile(apart, 0.9) <= POINT_APART, np.quantile(apart, [0.5, 0.9, 0.95, 1])
    assert apart.mean() <= POINT_MEAN


def test_environments_say_that_their_direct_light_is_missing(
    chromium: Any, split: Asset, serve: Callable[..., str], tmp_path: Path
) -> None:
    split.save(tmp_path / "asset")
    chromium("open", url=serve(tmp_path / "asset"), width=WIDTH, height=HEIGHT)
    chromium("choose", selector=".chip.add", value="point")
    assert "indirect light only" not in chromium("run", script="document.getElementById('status').textContent")
    picture = tmp_path / "environment.exr"
    write_image(picture, np.ones((4, 8, 3), np.float32), "float")
    chromium("drop", name="environment.exr", bytes=base64.b64encode(picture.read_bytes()).decode())
    assert "environments: indirect light only" in chromium("run", script="document.getElementById('status').textContent")


def test_a_site_adds_it_too(chromium: Any, split: Asset, serve_static: Callable[[Path], str], tmp_path: Path) -> None:
    export(split, "web", tmp_path / "site")
    lights = [DirectionalLight((-0.45, -0.5, 0.74))]
    with Added(split, "shadow-map") as added:
        expected = relight(split, lights, added.response(lights))
    where = f"#{{'zoom':{ZOOM},'middle':[{SIDE / 2},{SIDE / 2}],'exposure':0,'view':'texels'}}"
    chromium("open", url=serve_static(tmp_path / "site") + where, width=WIDTH, height=HEIGHT)
    apart = np.abs(chromium.texels(SIDE, SIDE, ZOOM) - shown_as(expected))
    assert (apart.max(), apart.mean()) <= (MOST_APART, MEAN_APART)


def test_shadows_on_a_mesh_are_finer_than_the_lightmap(chromium: Any, split: Asset, serve: Callable[..., str], tmp_path: Path) -> None:
    """Texels are 8 cm wide. The edge of a shadow is narrower than 0.4 of that; at the lightmap's resolution it is as wide as a texel."""
    source = {**split.manifest.get("source", {}), "receiver": {"kind": "lightmap", "object": "Ground"}}
    replace(split, manifest={**split.manifest, "source": source}).save(tmp_path / "asset")
    light = {"kind": "point", "on": True, "color": "#ffffff", "intensity": 1.0, "position": [-0.4, 0.1, 2.5], "a0": 2.5}
    state = {
        **{"terms": "direct", "exposure": 0, "selected": -1, "view": "mesh", "eye": [[0.0, -0.01, 2.2], [0.0, 0.0, 0.0]]},
        "lights": [{**light, "falloff": "inverse-square", "radius": 0.001}],
    }
    chromium("open", url=f"{serve(tmp_path / 'asset')}#{quote(json.dumps(state))}", width=WIDTH, height=HEIGHT)
    (tmp_path / "saved.png").write_bytes(chromium.file("Picture (PNG)"))
    shown = read_image(tmp_path / "saved.png", 3)[..., 1]
    row = shown[np.argmax((shown < 0.02).sum(axis=1))]  # through the shadow of the ball
    last = int(np.flatnonzero(row < 0.02).max())
    texel = 2 / SIDE * len(shown) / (2 * 2.2 * np.tan(np.radians(38 / 2)))  # pixels
    edge = row[last - 2 : last + int(2 * texel)]
    assert edge[-1] > 0.1, "light, beside the shadow"
    assert ((edge > 0.1 * edge[-1]) & (edge < 0.9 * edge[-1])).sum() < 0.4 * texel
