"""Deep framebuffers on the web: passes of the GPU and rays on the host give the picture of numpy; lights that stay are kept."""

from __future__ import annotations

import functools
import json
from collections.abc import Callable
from dataclasses import asdict, replace
from typing import Any

import made_profiles
import numpy as np
import pytest
from made_rooms import Room
from made_views import view_of_room, with_backs, with_lobes, with_specular_albedo, without_near

from srbf import methods
from srbf.asset import Asset
from srbf.light_profile import Profile
from srbf.lights import AreaLight, DirectionalLight, EnvironmentLight, Light, PointLight, SphereLight, SpotLight
from srbf.methods.deep_framebuffer import DeepFramebuffer

pytest.importorskip("embreex")

CLOSE = 2e-3  # of the largest value; 3e-4 measured in SwiftShader, of bounces that are left out
SEEN = 5e-3  # of lobes, which see few surfels: one of them at the edge of a shadow counts for more
RIM = 1e-2  # of a directional light, at whose edge of a shadow one of 700 surfels is lit in part
LIGHTS: dict[str, Light] = {
    "point": PointLight((0.8, 0.7, 1.1), (1, 0.5, 0.2), falloff="inverse-square"),
    "spot": SpotLight((2.0, 1.0, 1.5), falloff="inverse-square", direction=(0.2, 0, -1), inner=0.5, outer=0.8),
    "sphere": SphereLight((0.6, 1.2, 0.8), (0.2, 1, 0.4), size=0.1),
    "area": AreaLight((1.5, 1, 1.7), u=(0.6, 0, 0), v=(0, -0.3, 0)),
    "directional": DirectionalLight((0.2, 0.1, 1)),
}
NAMES: dict[type[Light], str] = {
    PointLight: "point",
    SpotLight: "spot",
    SphereLight: "sphere",
    AreaLight: "area",
    DirectionalLight: "directional",
}


RUNS = [
    *[{"run": "three-lightmap", "weights": weights} for weights in ("gpu", "cpu")],
    *[{"run": "nodes-lightmap", "weights": "cpu", "backend": backend} for backend in ("webgl", "webgpu")],
    *[{"run": "nodes-lightmap", "weights": "gpu", "backend": backend} for backend in ("webgl", "webgpu")],
    {"run": "nodes-lightmap", "weights": "compute", "backend": "webgpu"},
]


@pytest.fixture(scope="module")
def asset(tmp_path_factory: pytest.TempPathFactory) -> Asset:
    """Of a room without a lid."""
    room = Room.box((3, 2, 2), 0.25, 0.6, lid=False)
    return DeepFramebuffer().encode(view_of_room(tmp_path_factory.mktemp("view") / "capture", room, 700, 150, tested=0))


@pytest.fixture(scope="module")
def divided(tmp_path_factory: pytest.TempPathFactory) -> Asset:
    """Of many surfels, with a wall across that has a door."""
    room = Room.box((3, 2, 2), 0.25, 0.6, wall=(1.5, 0.6, 1.4), lid=False)
    return DeepFramebuffer().encode(view_of_room(tmp_path_factory.mktemp("divided") / "capture", room, 8000, 150, tested=0))


@pytest.fixture(scope="module")
def shiny(divided: Asset) -> Asset:
    """With lobes that see surfels reflect more than other surfels do, and pixels that let light through."""
    return with_backs(with_specular_albedo(divided))


@pytest.fixture(scope="module")
def url(browser: Any, asset: Asset) -> str:
    return browser.serve(asset)


def told(*lights: Light) -> list[dict[str, Any]]:
    around = [light for light in lights if isinstance(light, EnvironmentLight)]
    if around:
        height, width, _ = around[0].image.shape
        turn = float(np.arctan2(around[0].rotation[1, 0], around[0].rotation[0, 0]))
        map_of = {"kind": "environment", "color": around[0].color, "width": width, "height": height, "turn": turn}
        return [{**map_of, "pixels": around[0].image.ravel().tolist()}, *told(*(light for light in lights if light not in around))]
    return [{"kind": NAMES[type(light)], **asdict(light), **shape_of(light)} for light in lights]


def shape_of(light: Light) -> dict[str, Any]:
    profile = light.profile if isinstance(light, PointLight) else None
    if profile is None:
        return {}
    height, width, _ = profile.table.shape
    numbers = profile.table.ravel().tolist()
    return {"profile": {"width": width, "height": height, "numbers": numbers, "projected": profile.projected}}


@pytest.mark.parametrize("run", RUNS, ids=lambda run: "-".join(run.values()))
def test_the_picture_is_that_of_numpy(browser: Any, asset: Asset, url: str, run: dict[str, str]) -> None:
    """Of every kind of light, then all, then all in other colors, then none."""
    point: Any = LIGHTS["point"]
    every = list(LIGHTS.values())
    recolored = [replace(point, color=(0.1, 2.0, 0.4)), *every[1:]]
    sets = [*[[light] for light in every], every, recolored, every[:2], []]
    drawn = browser.lightmaps(asset=url, light_sets=[told(*lights) for lights in sets], **run)
    for picture, lights in zip(drawn, sets, strict=True):
        expected = methods.relight(asset, lights)
        tolerance = RIM if any(isinstance(light, DirectionalLight) for light in lights) else CLOSE
        np.testing.assert_allclose(picture, expected, atol=tolerance * max(expected.max(), 1e-9), err_msg=str(lights))


CLOSE_TO_A_WALL = PointLight((0.03, 1.2, 0.9), (1, 0.5, 0.2), falloff="inverse-square")
# In the open, close to a wall, whose light bright surfels send, and both.
ON_LOBES: list[list[Light]] = [[LIGHTS["point"]], [CLOSE_TO_A_WALL], [CLOSE_TO_A_WALL, LIGHTS["area"]]]
# 3 cm off a wall, in a corner, and beside the wall with the door, behind which less than all is seen of what is bright.
NEAR_WALLS: list[list[Light]] = [
    [PointLight(place, (1, 0.5, 0.2), falloff="inverse-square")] for place in ((0.03, 1.2, 0.9), (0.04, 0.05, 0.9), (1.47, 1.6, 0.5))
]
NEAR_WALLS.append([AreaLight((0.05, 1.0, 0.9), u=(0, 0.1, 0), v=(0, 0, -0.1)), LIGHTS["point"]])
Pictures = Callable[[int], tuple[str, list[np.ndarray]]]


def pictures_of(browser: Any, asset: Asset, sets: list[list[Light]]) -> Pictures:
    """By a number of bounces, made once for all runs: where the page finds the asset, and its pictures by numpy."""

    @functools.cache
    def limited(bounces: int) -> tuple[str, list[np.ndarray]]:
        few = replace(asset, manifest={**asset.manifest, "gather": {**asset.manifest["gather"], "bounces": bounces}})
        return browser.serve(few), [methods.relight(few, lights) for lights in sets]

    return limited


@pytest.fixture(scope="module")
def on_lobes(browser: Any, shiny: Asset) -> Pictures:
    return pictures_of(browser, shiny, ON_LOBES)


@pytest.fixture(scope="module")
def near_walls(browser: Any, divided: Asset) -> Pictures:
    return pictures_of(browser, divided, NEAR_WALLS)


@pytest.mark.parametrize("run", RUNS, ids=lambda run: "-".join(run.values()))
def test_lobes_and_backs_show_what_numpy_says(browser: Any, on_lobes: Pictures, run: dict[str, str]) -> None:
    """With few bounces, all, and none."""
    told_bounces = (1, 12, 0) if run["run"] == "three-lightmap" else (12,)
    for bounces in told_bounces:
        url, pictures = on_lobes(bounces)
        drawn = browser.lightmaps(asset=url, light_sets=[told(*lights) for lights in ON_LOBES], **run)
        for picture, expected, lights in zip(drawn, pictures, ON_LOBES, strict=True):
            assert (expected.max() > 0) == (bounces > 0)
            np.testing.assert_allclose(picture, expected, atol=SEEN * max(expected.max(), 1e-9), err_msg=str(lights))


def test_what_lobes_alone_see_is_seen(shiny: Asset) -> None:
    without = with_backs(with_lobes(divided_of(shiny)))
    for lights in ON_LOBES:
        seen, others = (methods.relight(one, lights) for one in (shiny, without))
        assert np.abs(seen - others).max() > 10 * CLOSE * seen.max()


def divided_of(shiny: Asset) -> Asset:
    """Without what only lobes see."""
    pool = shiny.tables["pool"][:3]
    gather = {key: value for key, value in shiny.manifest["gather"].items() if key != "specular_albedo"}
    return replace(shiny, manifest={**shiny.manifest, "gather": gather}, tables={**shiny.tables, "pool": pool})


@pytest.mark.parametrize("run", RUNS[:2] + RUNS[4:], ids=lambda run: "-".join(run.values()))
def test_bright_surfels_light_as_in_numpy(browser: Any, near_walls: Pictures, run: dict[str, str]) -> None:
    for bounces in (1, 12):
        url, pictures = near_walls(bounces)
        drawn = browser.lightmaps(asset=url, light_sets=[told(*lights) for lights in NEAR_WALLS], **run)
        for picture, expected, lights in zip(drawn, pictures, NEAR_WALLS, strict=True):
            np.testing.assert_allclose(picture, expected, atol=CLOSE * expected.max(), err_msg=str(lights))


def test_bright_surfels_are_seen(divided: Asset) -> None:
    bare = without_near(divided)
    for lights in NEAR_WALLS:
        expected = methods.relight(divided, lights)
        assert np.abs(methods.relight(bare, lights) - expected).max() > 10 * CLOSE * expected.max()


def test_a_light_that_stays_is_not_computed_again(browser: Any, url: str) -> None:
    """Recolored, joined by another, alone again; then it moves, and goes back."""
    point: Any = PointLight((0.8, 0.7, 1.1), falloff="inverse-square")
    spot, moved = LIGHTS["spot"], replace(point, position=(0.9, 0.7, 1.1))
    kept = [[point], [replace(point, color=(0.1, 2.0, 0.0))], [spot, point], [point, spot, point], [point]]
    for sets, computed in ((kept, 2), ([*kept, [moved]], 3), ([*kept, [moved], [point]], 4)):
        said = browser.response("three-lightmap", asset=url, lightSets=[told(*lights) for lights in sets], weights="gpu")
        assert said["computed"] == computed


@pytest.mark.parametrize("run", RUNS, ids=lambda run: "-".join(run.values()))
def test_profiles_shape_the_light_on_surfels(browser: Any, asset: Asset, url: str, run: dict[str, str]) -> None:
    """An uneven one, turned, of a point and of a sphere; a colored picture that a spot projects. One that stays is not computed again."""
    point: Any = LIGHTS["point"]
    sphere: Any = LIGHTS["sphere"]
    spot: Any = LIGHTS["spot"]
    coarse = Profile(made_profiles.uneven.table[::12, ::24])
    lights: list[Light] = [
        replace(point, profile=coarse, direction=(0.5, 0.2, -0.7), roll=0.6),
        replace(sphere, profile=coarse, direction=(0.0, 0.0, 1.0), roll=-0.3),
        replace(spot, profile=Profile(made_profiles.picture(), projected=True), roll=0.4),
    ]
    sets: list[list[Light]] = [*[[light] for light in lights], lights]
    drawn = browser.lightmaps(asset=url, light_sets=[told(*own) for own in sets], **run)
    for shown, own in zip(drawn, sets, strict=True):
        expected = methods.relight(asset, own)
        np.testing.assert_allclose(shown, expected, atol=CLOSE * expected.max(), err_msg=str(own))
    said = browser.response("three-lightmap", asset=url, lightSets=[told(*lights), told(lights[0])], weights="gpu")
    assert said["computed"] == 3


@pytest.mark.parametrize("run", RUNS, ids=lambda run: "-".join(run.values()))
def test_an_environment_reaches_surfels_as_in_numpy(browser: Any, asset: Asset, run: dict[str, str]) -> None:
    """Through the open top of a room that is turned about x, alone and beside a point light; recolored it is not computed again."""
    rng = np.random.default_rng(12)
    image = rng.uniform(0, 2, (40, 70, 3)).astype(np.float32) * np.linspace(2, 0.1, 40, dtype=np.float32)[:, None, None]
    image[5:9, 10:14] += 60
    around = EnvironmentLight(image, (0.5, 0.8, 1.0)).turned(0.4)
    c, s = np.cos(0.4), np.sin(0.4)
    matrix = [[1.0, 0.0, 0.0, 0.0], [0.0, c, -s, 0.0], [0.0, s, c, 0.0], [0.0, 0.0, 0.0, 1.0]]
    turned = replace(asset, manifest={**asset.manifest, "asset_from_world": matrix})
    red = replace(around, color=(1.0, 0.1, 0.1))
    sets: list[list[Light]] = [[around], [red, LIGHTS["point"]]]
    url = browser.serve(turned)
    drawn = browser.lightmaps(asset=url, light_sets=[told(*own) for own in sets], **run)
    for shown, own in zip(drawn, sets, strict=True):
        expected = methods.relight(turned, own)
        np.testing.assert_allclose(shown, expected, atol=RIM * expected.max(), err_msg=str(len(own)))
        assert np.abs(shown - expected).mean() < CLOSE * expected.max()
    if run == RUNS[0]:
        assert browser.response("three-lightmap", asset=url, lightSets=[told(*own) for own in sets], weights="gpu")["computed"] == 2


def test_nodes_name_what_the_gpu_does_not_compute_there(browser: Any, url: str) -> None:
    said = browser.response("nodes-lightmap", asset=url, lightSets=[[]], weights="compute", backend="webgl")
    assert 'weights: "gpu"' in said["error"]


@pytest.mark.parametrize(("key", "value"), [("gather", {"surfels": 0}), ("pool", None), ("scene", None)])
def test_a_manifest_without_what_it_needs_is_refused(browser: Any, asset: Asset, key: str, value: Any) -> None:
    url = browser.serve(asset)
    path = browser.folder(url) / "asset.json"
    manifest = json.loads(path.read_text())
    path.write_text(json.dumps(manifest | {key: value}))
    assert "srbf fit" in browser.response("three-lightmap", asset=url, lightSets=[[]])["error"]


@pytest.mark.parametrize("run", ["babylon-material", "playcanvas-material"])
def test_other_engines_show_what_rays_on_the_host_say(browser: Any, asset: Asset, run: str) -> None:
    lights = [LIGHTS["point"], LIGHTS["spot"]]
    asset = with_backs(with_specular_albedo(asset))
    url = browser.serve(asset)
    shown = browser.picture(run, asset=url, lights=lights, color=(1.0, 1.0, 1.0), half=(1.0, 1.0, 0.0))
    expected, covered = methods.relight(asset, lights), asset.images["coverage"] > 0.5
    np.testing.assert_allclose(shown[covered], expected[covered], atol=CLOSE * expected.max())
