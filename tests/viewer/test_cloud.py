"""Lights inside a room on the page: a light of any kind starts in free space, and its picture is that of rays against every triangle."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import quote
from urllib.request import urlopen

import numpy as np
import pytest
from cloud_assets import PATCHES, PLACES, Room, room, with_table, with_transfer
from test_page import HEIGHT, STEP, WIDTH, ZOOM, shown_as
from test_web_cloud import AREA, POINT, SPHERE, SPOT, received
from test_web_environments import ENVIRONMENT, MAP, expected_of, with_windows

from srbf.errors import InputError
from srbf.io.image import write_image
from srbf.lights import AreaLight, EnvironmentLight, PointLight, SphereLight, SpotLight

EXPOSURE = -3.0
HOLDOUT = np.float32(1.1)  # of captured images over the room's


@pytest.fixture
def made() -> Room:
    return with_table(room())[0]


@pytest.fixture
def url(made: Room, serve: Callable[..., str], tmp_path: Path) -> str:
    made.write(tmp_path / "asset")
    return serve(tmp_path / "asset")


def opened(chromium: Any, url: str, **state: Any) -> None:
    hashed = json.dumps({"zoom": ZOOM, "middle": [7, 4.5], "view": "texels", "terms": "indirect", "exposure": EXPOSURE, **state})
    chromium("open", url=f"{url}#{quote(hashed)}", width=WIDTH, height=HEIGHT)


def shows(chromium: Any, made: Room, lights: list[dict[str, Any]]) -> bool:
    weights = made.weights(np.sum([received(made, light) for light in lights], axis=0))
    expected = shown_as(np.maximum(made.response(weights), 0), EXPOSURE)
    assert np.ptp(expected) > 60
    return bool((np.abs(chromium.texels(14, 9, ZOOM) - expected) <= STEP).all())


def test_a_light_starts_in_the_middle_of_the_free_space(chromium: Any, made: Room, url: str) -> None:
    opened(chromium, url)
    (light,) = chromium.state()["lights"]
    assert light["kind"] == "point"
    assert tuple(light["position"]) in {tuple(place) for place in PLACES}
    shown = {**POINT, "position": light["position"], "a0": light["a0"], "radius": light["radius"], "color": (1.0, 1.0, 1.0)}
    assert shows(chromium, made, [shown])
    chromium("number", name="Position x (m)", value=-1.4)
    assert shows(chromium, made, [{**shown, "position": [-1.4, *light["position"][1:]]}])
    chromium("number", name="Position x (m)", value=4.5)
    assert "outside the space that lights were captured in" in chromium("run", script="document.getElementById('hint').textContent")


def test_every_kind_of_light_is_relit_and_saved(chromium: Any, made: Room, url: str) -> None:
    """Added by the panel; what FRAMES.json says of them is what is seen."""
    opened(chromium, url)
    for kind in ("spot", "sphere", "area"):
        chromium("choose", selector=".chip.add", value=kind)
        chromium("number", name="Position x (m)", value=-1.0)
    chromium("number", name="Turn (°)", value=30)
    saved = json.loads(chromium.file("Lights (FRAMES.json)"))["frames"][0]["lights"]
    assert [light["kind"] for light in saved] == ["point", "spot", "sphere", "area"]
    assert shows(chromium, made, [{"radius": 1e-3, **light} for light in saved])
    for light, of_kind in zip(saved, (PointLight, SpotLight, SphereLight, AreaLight), strict=True):
        of_kind(**{key: tuple(value) if isinstance(value, list) else value for key, value in light.items() if key != "kind"})


def test_frames_move_lights_through_the_room(chromium: Any, made: Room, url: str) -> None:
    """Lights come and go from frame to frame."""
    opened(chromium, url)
    frames = [[POINT], [POINT, SPOT], [AREA, SPHERE]]
    text = json.dumps({"frames": [{"lights": lights} for lights in frames]})
    chromium("drop", name="FRAMES.json", bytes=base64.b64encode(text.encode()).decode(), moving=True)
    chromium("press", keys=["Space"])
    kinds = [light["kind"] for light in chromium.state()["lights"]]
    assert kinds in [[light["kind"] for light in lights] for lights in frames]
    (lights,) = [lights for lights in frames if [light["kind"] for light in lights] == kinds]
    weights = made.weights(np.sum([received(made, light) for light in lights], axis=0))
    expected = shown_as(np.maximum(made.response(weights), 0), EXPOSURE)
    assert np.abs(chromium.texels(14, 9, ZOOM) - expected).max() <= 4, "colors are bytes on the page"


@pytest.mark.parametrize("kind", ["sphere", "area"])
def test_large_lights_cast_soft_shadows(chromium: Any, made: Room, url: str, kind: str) -> None:
    """Direct light of several looks, against a fine grid of points by rays."""
    light: dict[str, Any] = (
        {**SPHERE, "size": 0.3, "falloff": "inverse-square"} if kind == "sphere" else {**AREA, "position": (0.9, -0.2, 2.0)}
    )
    light["color"] = (1.0, 1.0, 1.0)
    state: dict[str, Any] = {
        "on": True,
        "color": "#ffffff",
        "intensity": 1.0,
        "kind": kind,
        "position": light["position"],
        "a0": light["a0"],
    }
    if kind == "sphere":
        state |= {"size": 0.3, "falloff": "inverse-square", "radius": 1e-3}
        rng = np.random.default_rng(4)
        normals = rng.normal(size=(400, 3))
        emitters = np.array(light["position"]) + 0.3 * normals / np.linalg.norm(normals, axis=1)[:, None]
        facing = None
    else:
        state |= {"target": [0.9, -0.2, 1.0], "width": 0.6, "height": 0.3, "turn": 0.0}
        steps = (np.arange(20) + 0.5) / 20 - 0.5
        emitters = np.array([np.array(light["position"]) + [0.6 * s, 0.3 * t, 0] for s in steps for t in steps])
        facing = np.array([0.0, 0.0, -1.0])
    expected = np.zeros((9, 14))
    place = made.files["position.exr"][0].reshape(-1, 3).astype(float)
    for emitter in emitters:
        vector = emitter - place
        squared = (vector**2).sum(axis=1)
        amount = vector[:, 2] / np.sqrt(squared) * light["a0"] ** 2 / squared
        if facing is not None:
            amount = amount * np.maximum(-(vector @ facing) / np.sqrt(squared), 0)
        amount[made.blocked(place + [0, 0, 1e-4], emitter)] = 0
        expected += amount.reshape(expected.shape) / len(emitters)
    opened(chromium, url, terms="direct", lights=[state])
    apart = np.abs(chromium.texels(14, 9, ZOOM)[..., 0] - shown_as(expected[..., None], EXPOSURE)[..., 0])
    assert np.median(apart) <= 2 and apart.mean() <= 5, (np.quantile(apart, [0.5, 0.9, 1]), apart.mean())


def test_an_environment_shines_through_windows_and_turns(chromium: Any, serve: Callable[..., str], tmp_path: Path) -> None:
    """The one that the page begins with: alone, turned, and brighter beside a light inside; a closed room takes none."""
    windows, table = with_windows(with_transfer(with_table(room())[0]))
    windows.write(tmp_path / "asset")
    opened(chromium, serve(tmp_path / "asset", environments=[("around.exr", EnvironmentLight(MAP))]))
    around = {**ENVIRONMENT, "color": [1.0, 1.0, 1.0]}
    for turn in (0, 75):
        chromium("number", name="Turn (°)", value=turn)
        expected = shown_as(expected_of(windows, table, [{**around, "turn": np.radians(turn)}]), EXPOSURE)
        assert expected.mean() > 40
        assert (np.abs(chromium.texels(14, 9, ZOOM) - expected) <= STEP + 1).all()
    made, _ = with_table(room())
    made.write(tmp_path / "closed")
    with pytest.raises(InputError, match="or a room with windows for an environment"):
        serve(tmp_path / "closed", environments=[("around.exr", EnvironmentLight(MAP))])


@pytest.fixture
def captured(made: Room, tmp_path: Path) -> Path:
    """A capture of patches with four held-out point lights, whose images are 1.1 times the room's."""
    folder = tmp_path / "capture"
    (folder / "lights").mkdir(parents=True)
    lights: list[dict[str, Any]] = []
    for patch in range(PATCHES):
        lights.append({"kind": "patch", "patch": patch, "role": "train", "file": f"lights/{patch:04d}.exr"})
        alone = np.zeros((PATCHES, 3))
        alone[patch] = 1
        write_image(folder / lights[-1]["file"], made.response(made.weights(alone)).astype(np.float32), "half")
    for place in PLACES[:4]:
        lights.append({"kind": "point", "position": place, "role": "holdout", "file": f"lights/{len(lights):04d}.exr"})
        write_image(folder / lights[-1]["file"], HOLDOUT * reference(made, place).astype(np.float32), "float")
    write_image(folder / "patches.exr", made.cells, "float")
    (folder / "scene.glb").write_bytes(made.scene)
    for name in ("position", "normal", "coverage"):
        write_image(folder / f"{name}.exr", made.files[f"{name}.exr"][0], "float")
    manifest = {
        **{"format": "srbf-capture", "version": 1, "quantity": "irradiance", "transport": "indirect", "width": 14, "height": 9},
        **{"row_origin": "top", "axes": "z-up-right-handed", "scene": "scene.glb", "free_places": PLACES, "lights": lights},
        **{"patches": {"count": PATCHES, "file": "patches.exr"}, "receiver": {"kind": "lightmap", "object": "Floor"}},
        **{"position": "position.exr", "normal": "normal.exr", "coverage": "coverage.exr"},
    }
    (folder / "capture.json").write_text(json.dumps(manifest))
    return folder


def reference(made: Room, place: tuple[float, float, float]) -> np.ndarray:
    """(H, W, 3), signed, under a captured point light."""
    light = {**POINT, "position": place, "a0": 1.0, "radius": 1e-4, "color": (1.0, 1.0, 1.0)}
    return made.response(made.weights(received(made, light)))


def test_captured_point_lights_are_compared_with(
    chromium: Any, made: Room, captured: Path, serve: Callable[..., str], tmp_path: Path
) -> None:
    """The nearest one to the light, its image beside the picture; and every one's error."""
    made.write(tmp_path / "asset")
    url = serve(tmp_path / "asset", captured)
    near = [x + 0.1 for x in PLACES[2]]
    light = {"kind": "point", "on": True, "color": "#ffffff", "intensity": 1.0, "position": near, "a0": 2.0, "falloff": "inverse-square"}
    opened(chromium, url, lights=[{**light, "radius": 0.001}], compare="reference")
    truth = reference(made, PLACES[2])
    expected = shown_as(np.maximum(HOLDOUT * truth, 0), EXPOSURE)
    assert np.abs(chromium.texels(14, 9, ZOOM) - expected).max() <= STEP + 0.1
    assert "baked light" in chromium("run", script="document.getElementById('status').textContent")
    told = json.loads(urlopen(f"{url}capture/errors-0.json").read())
    errors = [float(np.sqrt(((HOLDOUT - 1) ** 2 * reference(made, place) ** 2).mean())) for place in PLACES[:4]]
    np.testing.assert_allclose(told["rmse"], errors, rtol=0.02)
    opened(chromium, url, errors=True, view="mesh")
    chromium("press", keys=["?", "?"])
    assert "PSNR of every captured point light" in chromium("run", script="document.getElementById('hint').textContent")


def test_walls_are_cut_open(chromium: Any, made: Room, url: str) -> None:
    """The floor from below: hidden, as it would hide the room, until one wants to see it."""
    below = {"eye": [[0.0, 0.1, -6.0], [0.0, 0.0, 0.0]], "view": "mesh", "exposure": 2, "terms": "both"}
    opened(chromium, url, **below)
    assert chromium.state()["cut"]
    assert _empty(chromium) > 0.85, "nothing but the light and its handles"
    opened(chromium, url, **below, cut=False)
    assert _empty(chromium) < 0.75


def _empty(chromium: Any) -> float:
    """The share of the canvas that has the color of its corner."""
    canvas = chromium.canvas()
    return float((canvas == canvas[0, 0]).all(axis=2).mean())
