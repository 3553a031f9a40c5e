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


HIGH, ABOVE = 2.2, np.array([-0.4, 0.1, 2.5])  # of the eye and of the light, m


def from_above(folder: Path, split: Asset, serve: Callable[..., str], terms: str) -> str:
    """The address of a page that shows the ground on its mesh, under a point light over the ball."""
    source = {**split.manifest.get("source", {}), "receiver": {"kind": "lightmap", "object": "Ground"}}
    replace(split, manifest={**split.manifest, "source": source}).save(folder, force=True)
    light = {"kind": "point", "on": True, "color": "#ffffff", "intensity": 1.0, "position": ABOVE.tolist(), "a0": 2.5}
    state = {
        **{"terms": terms, "exposure": 0, "selected": -1, "view": "mesh", "eye": [[0.0, -1e-4, HIGH], [0.0, 0.0, 0.0]]},
        "lights": [{**light, "falloff": "inverse-square", "radius": 0.001}],
    }
    return f"{serve(folder)}#{quote(json.dumps(state))}"


def albedo_at(place: np.ndarray) -> np.ndarray:
    x, y = place[..., 0], place[..., 1]
    return np.stack([0.5 + 0.4 * x, 0.5 + 0.4 * y, 0.4 - 0.2 * x + 0.1 * y], axis=-1)


def picture_of(chromium: Any, url: str, path: Path) -> np.ndarray:
    """Linear (H, W, 3)."""
    chromium("open", url=url, width=WIDTH, height=HEIGHT)
    path.write_bytes(chromium.file("Picture (PNG)"))
    stored = read_image(path, 3)
    return np.where(stored > 0.04045, ((stored + 0.055) / 1.055) ** 2.4, stored / 12.92)


def test_shadows_on_a_mesh_are_as_sharp_as_the_screen(chromium: Any, split: Asset, serve: Callable[..., str], tmp_path: Path) -> None:
    """Texels are 8 cm wide, pixels 3 mm. Every pixel has the light of its own place by the closed form, and that of its texels."""
    bright = replace(split, stored=np.abs(split.stored))
    if split.manifest["quantity"] == "radiance":  # that varies across the ground, and otherwise along it
        bright = replace(bright, images={**split.images, "albedo": albedo_at(split.images["position"]).astype(np.float32)})
    shown, indirect, both = (
        picture_of(chromium, from_above(tmp_path / terms, bright, serve, terms), tmp_path / f"{terms}.png")
        for terms in ("direct", "indirect", "both")
    )
    height, width = shown.shape[:2]
    pixel = 2 * HIGH * np.tan(np.radians(38 / 2)) / height
    x, y = np.meshgrid((np.arange(width) + 0.5 - width / 2) * pixel, (height / 2 - np.arange(height) - 0.5) * pixel)
    place = np.stack([x, y, np.zeros_like(x)], axis=2)
    away = ABOVE - place
    far = np.linalg.norm(away, axis=2)
    along = ((np.array([-0.4, 0.1, 0.6]) - place) * away).sum(axis=2) / far
    beside = np.sqrt(((np.array([-0.4, 0.1, 0.6]) - place) ** 2).sum(axis=2) - along**2)  # of the ray, from the ball's center
    clear = (np.abs(x) < 0.95) & (np.abs(y) < 0.95) & (x < 0.1) & (np.abs(beside - 0.35) > 0.01)  # not through the pane
    expected = np.where(beside < 0.35, 0, away[..., 2] / far * (2.5 / far) ** 2)[..., None] * np.ones(3)
    if split.manifest["quantity"] == "radiance":
        expected = expected * albedo_at(place) / np.pi
    dark = clear & (beside < 0.35)
    assert dark.sum() > 1000
    assert shown[dark].max() < 0.02
    lit = clear & (beside > 0.35)
    np.testing.assert_allclose(shown[lit], np.minimum(expected[lit], 1), atol=0.02)
    total = shown + indirect
    inside = total < 0.9
    assert indirect.max() > 0.02
    assert inside.mean() > 0.2
    np.testing.assert_allclose(both[inside], total[inside], atol=0.02)


@pytest.mark.parametrize("split", ["irradiance"], indirect=True)
def test_pixels_keep_their_light_over_changes_of_asset_and_view(
    chromium: Any, split: Asset, serve: Callable[..., str], tmp_path: Path
) -> None:
    from_above(tmp_path / "one", split, lambda _: "", "both")
    from_above(tmp_path / "other", replace(split, stored=-split.stored), lambda _: "", "both")

    def shown() -> np.ndarray:
        (tmp_path / "saved.png").write_bytes(chromium.file("Picture (PNG)"))
        return read_image(tmp_path / "saved.png", 3)

    def pressed(key: str, expected: dict[str, Any]) -> np.ndarray:
        chromium("press", keys=[key])
        assert {name: chromium.state().get(name, 0) for name in expected} == expected
        return shown()

    hashed = from_above(tmp_path / "state", split, lambda _: "", "both")
    chromium("open", url=serve([tmp_path / "one", tmp_path / "other"]) + hashed, width=WIDTH, height=HEIGHT)
    first = shown()
    assert np.abs(pressed("a", {"asset": 1}) - first).max() > 0.05
    np.testing.assert_array_equal(pressed("a", {"asset": 0}), first)
    views = [pressed("t", {}) for _ in range(2)]
    assert views[0].shape != first.shape, "of the texels"
    np.testing.assert_array_equal(views[1], first)
