"""Lights inside the scene, without a GPU: the weights of every kind of light are those of rays against every triangle."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from cloud_assets import GRID, LOW, Room, room, with_table, with_transfer
from web_assets import ALBEDO

CLOSE = 1e-6  # relative: single precision of cells on disk, the same in both
POINT: dict[str, Any] = {
    "kind": "point",
    "position": (-1.1, 0.3, 1.4),
    "color": (0.7, 1.0, 0.4),
    "a0": 1.5,
    "falloff": "inverse-square",
    "radius": 1e-3,
}
SPOT: dict[str, Any] = {**POINT, "kind": "spot", "direction": (0.6, -0.0, -0.8), "inner": 0.3, "outer": 0.7, "color": (1.0, 0.2, 0.1)}
SPHERE = {**POINT, "kind": "sphere", "position": (1.2, -0.6, 0.9), "size": 0.1, "falloff": "linear"}
AREA = {"kind": "area", "position": (-0.9, 0.2, 2.4), "u": (0.0, 0.3, 0.0), "v": (0.6, 0.0, 0.0), "color": (1.0, 0.9, 0.5), "a0": 1.0}
SUN = {"kind": "directional", "direction": (0.1, 0.2, 0.97), "color": (1.0, 1.0, 1.0)}
LIGHTS = {"point": [POINT], "spot": [SPOT], "sphere": [SPHERE], "area": [AREA], "all": [POINT, SPOT, SPHERE, AREA]}


@pytest.fixture(scope="module")
def made() -> Room:
    return room()


@pytest.fixture(scope="module")
def url(browser: Any, made: Room) -> str:
    return browser.place(made.write)


def received(made: Room, light: dict[str, Any]) -> np.ndarray:
    """(K, 3) mean irradiance of the patches."""
    a0, place = light["a0"], np.array(light["position"])
    if light["kind"] == "area":
        u, v = np.array(light["u"]), np.array(light["v"])
        facing = np.cross(u, v) / np.linalg.norm(np.cross(u, v))
        steps = (np.arange(GRID) + 0.5) / GRID - 0.5
        points = [place + s * u + t * v for s in steps for t in steps]

        def strength(squared: np.ndarray, unit: np.ndarray, least: np.ndarray) -> np.ndarray:
            return np.maximum(-(unit @ facing), 0) * a0**2 / np.maximum(squared, least)

        mean = np.mean([made.irradiance(point, strength) for point in points], axis=0)
        return mean[:, None] * light["color"]

    def of_point(squared: np.ndarray, unit: np.ndarray, least: np.ndarray) -> np.ndarray:
        near = np.maximum(np.maximum(squared, light["radius"] ** 2), least)
        fade = a0**2 / near if light["falloff"] == "inverse-square" else a0 / np.sqrt(near)
        if light["kind"] != "spot":
            return fade
        axis = np.array(light["direction"]) / np.linalg.norm(light["direction"])
        t = np.clip((-(unit @ axis) - np.cos(light["outer"])) / (np.cos(light["inner"]) - np.cos(light["outer"])), 0, 1)
        return fade * t * t * (3 - 2 * t)

    return made.irradiance(place, of_point)[:, None] * light["color"]


@pytest.mark.parametrize("kind", LIGHTS)
def test_weights_are_those_of_rays_against_every_triangle(browser: Any, made: Room, url: str, kind: str) -> None:
    said = browser.response("host", asset=url, raw=LIGHTS[kind])
    assert said["pointLights"] == [], "the cost per texel is the same for any number of lights"
    each = np.sum([received(made, light) for light in LIGHTS[kind]], axis=0)
    expected = made.weights(each)
    np.testing.assert_allclose(np.reshape(said["weights"], (-1, 3)), expected, atol=CLOSE * np.abs(expected).max())


def test_weights_of_transfer_go_by_way_of_shapes(browser: Any, made: Room) -> None:
    transferred = with_transfer(made)
    said = browser.response("host", asset=browser.place(transferred.write), raw=LIGHTS["all"])
    assert "weights" in said, said
    expected = transferred.weights(np.sum([received(made, light) for light in LIGHTS["all"]], axis=0))
    np.testing.assert_allclose(np.reshape(said["weights"], (-1, 3)), expected, atol=CLOSE * np.abs(expected).max())


@pytest.mark.parametrize("rays", [True, False])
def test_a_table_gives_the_weights_of_point_lights_without_rays(browser: Any, made: Room, rays: bool) -> None:
    """Anywhere in and around the grid, also where no node is seen; what a table does not hold needs rays, and says so without."""
    asset, table = with_table(made, rays)
    url = browser.place(asset.write)
    places = np.random.default_rng(2).uniform(LOW - 0.5, -LOW + [0, 0, 3], (40, 3))
    places[0], places[1] = table.origin + 0.3, table.origin  # in the cell that sees nothing; on a node
    for place in places:
        light = {**POINT, "position": place.tolist()}
        expected = table.weights(place) * 1.5**2 * np.array(light["color"])
        said = browser.response("host", asset=url, raw=[light])["weights"]
        np.testing.assert_allclose(np.reshape(said, (-1, 3)), expected, atol=1e-5 * np.abs(expected).max())
    both = browser.response("host", asset=url, raw=[POINT, SPOT])
    if rays:
        expected = table.weights(POINT["position"]) * 1.5**2 * np.array(POINT["color"]) + made.weights(received(made, SPOT))
        np.testing.assert_allclose(np.reshape(both["weights"], (-1, 3)), expected, atol=1e-5 * np.abs(expected).max())
        exact = browser.response("host", asset=url, raw=[POINT], exact=True)["weights"]
        np.testing.assert_allclose(np.reshape(exact, (-1, 3)), made.weights(received(made, POINT)), atol=1e-5)
    else:
        assert "expected an asset of patches with cells.exr and scene.glb for a spot light" in both["error"]


# As three.js, y up, has them, and as the library does.
FOLLOWED: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "point": (
        {"type": "PointLight", "color": (0.2, 0.6, 0.9), "intensity": 3, "position": (-1.1, 1.4, -0.3)},
        {**POINT, "color": (0.6, 1.8, 2.7), "a0": 1.0, "radius": 0.1},
    ),
    "spot": (
        {
            **{"type": "SpotLight", "color": (1, 0.8, 0.5), "intensity": 2, "position": (-1.1, 1.4, -0.3), "target": (-0.5, 0.6, -0.3)},
            **{"angle": 0.7, "penumbra": 0.5},
        },
        {**SPOT, "color": (2, 1.6, 1), "a0": 1.0, "radius": 0.1, "inner": 0.35},
    ),
    "area": (
        {
            **{
                "type": "RectAreaLight",
                "color": (1, 0.9, 0.5),
                "intensity": 5,
                "position": (-0.9, 2.4, -0.2),
                "target": (-0.9, 0, -0.2001),
            },
            **{"width": 0.6, "height": 0.3},
        },
        {**AREA, "color": tuple(0.18 * 5 * np.array([1, 0.9, 0.5]))},
    ),
}


@pytest.mark.parametrize("run", ["three-material", "nodes-material"])
@pytest.mark.parametrize("kind", FOLLOWED)
def test_three_s_own_lights_are_followed_through_the_room(browser: Any, made: Room, url: str, kind: str, run: str) -> None:
    """Their bounces, in three's units and its y-up world; the direct light is the engine's own."""
    followed, light = FOLLOWED[kind]
    job = {
        "asset": url,
        "material": "MeshLambertMaterial",
        "color": ALBEDO,
        "half": (2.0, 1.5, 0.0),
        "source": "lightmap",
        "backend": "webgl",
    }
    shown = browser.picture(run, **job, follow=[followed], apply={"direct": "asset"}) * np.pi / ALBEDO
    expected = np.maximum(made.response(made.weights(received(made, light))), 0)
    assert expected.max() > 0.1
    np.testing.assert_allclose(shown, expected, atol=2e-4 * expected.max())


@pytest.mark.parametrize("run", ["babylon-material", "playcanvas-material"])
def test_other_engines_light_by_the_same_weights(browser: Any, made: Room, url: str, run: str) -> None:
    job = {"asset": url, "color": ALBEDO, "half": (2.0, 1.5, 0.0), "rightHanded": True, "apply": {"direct": "asset"}}
    shown = browser.picture(run, **job, raw=LIGHTS["all"]) * np.pi / ALBEDO
    each = np.sum([received(made, light) for light in LIGHTS["all"]], axis=0)
    expected = np.maximum(made.response(made.weights(each)), 0)
    np.testing.assert_allclose(shown, np.minimum(expected, 30 * np.pi / np.array(ALBEDO)), atol=2e-4 * expected.max())


def test_a_partition_hides_and_a_closed_room_has_no_sun(browser: Any, made: Room, url: str) -> None:
    """Where the light cannot look, a patch of its own gets nothing; a sun outside the box lights nothing."""
    partition_matters = received(made, POINT) - received(
        Room(made.manifest, made.files, made.scene, made.corners[:12], made.cells, made.values), POINT
    )
    assert np.abs(partition_matters).max() > 0.05
    assert not np.any(browser.response("host", asset=url, raw=[SUN])["weights"])


def test_what_a_cloud_needs_is_named(browser: Any, made: Room) -> None:
    for key, expected in {
        "cells": "expected cells of patches and a scene",
        "scene": "expected cells of patches and a scene",
        "light_values": "expected light_values",
    }.items():
        manifest = {name: value for name, value in made.manifest.items() if name != key}
        broken = Room(manifest, made.files, made.scene, made.corners, made.cells, made.values)
        assert expected in browser.response("load", asset=browser.place(broken.write))["error"]
    damaged = Room(made.manifest, made.files, made.scene[:64], made.corners, made.cells, made.values)
    assert "expected triangles as binary glTF 2.0 in scene.glb" in browser.response("load", asset=browser.place(damaged.write))["error"]
