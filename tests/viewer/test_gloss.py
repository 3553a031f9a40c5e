"""Direct light on glossy and translucent pixels of a view: the page's is what rays say; a profile shapes direct light and bounces."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from http import HTTPStatus
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import pytest
from closed_forms import ball, build_plane, quad
from made_profiles import UNEVEN, picture, uneven
from made_rooms import Room
from made_views import view_of_room
from test_page import HEIGHT, WIDTH, lights_of, shown_as
from typer.testing import CliRunner
from view_assets import scene_glb
from web_assets import complete

from srbf.asset import Asset
from srbf.cli import app
from srbf.cli.light_arguments import read_frames, read_profile
from srbf.errors import InputError
from srbf.io.image import read_image, write_picture
from srbf.lights import AreaLight, DirectionalLight, Light, PointLight, SphereLight, SpotLight
from srbf.methods import relight
from srbf.methods.deep_framebuffer import DeepFramebuffer
from srbf.relighting.direct_light import Added
from srbf.unshadowed import irradiance_from
from srbf.viewer.contents import contents_of
from srbf.viewer.cycles import CyclesRenders
from srbf.visibility.glossy_direct import GlossyPixels
from srbf.visibility.hemisphere import GOLDEN
from srbf.visibility.light_rays import rays_towards
from srbf.visibility.receivers import Receivers

pytest.importorskip("embreex")

SIDE, ZOOM = 24, 16
APART, MEAN = 3.0, 2.0  # of 255: at the 90 % quantile, and in the mean; at shadow edges the page averages four points per texel
SHAPED = 3.0  # bytes of the picture under a light with a profile
SAMPLES = 1000  # places on a light
HIGH = 2.0  # m: of the camera above the plane
CAMERA = {
    "type": "PERSP",
    "matrix_world": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, HIGH], [0, 0, 0, 1]],
    "frame": [[0.5, 0.5, -HIGH / 2], [0.5, -0.5, -HIGH / 2], [-0.5, -0.5, -HIGH / 2], [-0.5, 0.5, -HIGH / 2]],
    "filter": "BOX",
    "filter_width": 1.0,
}
COMMON: dict[str, Any] = {"on": True, "color": "#ffffff", "intensity": 1.0}
FADE: dict[str, Any] = {"falloff": "inverse-square", "radius": 0.001}
PLACE = (1.3, -0.3, 1.2)
INSIDE = (1.1, 0.8, 1.4)
OVER: dict[str, tuple[dict[str, Any], Light]] = {
    "point": ({"kind": "point", **FADE, "position": PLACE, "a0": 1.0}, PointLight(PLACE, a0=1.0, falloff="inverse-square", radius=0.001)),
    "sun": ({"kind": "directional", "direction": [-0.1, -0.15, 1]}, DirectionalLight((-0.1, -0.15, 1))),
    "soft sun": (
        {"kind": "directional", "direction": [-0.1, -0.15, 1], "angle": 8},
        DirectionalLight((-0.1, -0.15, 1), angle=np.radians(8)),
    ),
    "soft spot": (
        {"kind": "spot", **FADE, "position": PLACE, "target": [0.2, 0.0, 0.0], "a0": 1.0, "inner": 20, "outer": 30, "size": 0.1},
        SpotLight(
            PLACE,
            direction=(-1.1, 0.3, -1.2),
            inner=np.radians(20),
            outer=np.radians(30),
            a0=1.0,
            falloff="inverse-square",
            radius=0.1,
            size=0.1,
        ),
    ),
    "behind": (
        {"kind": "point", **FADE, "position": [0.25, -0.3, -1.1], "a0": 1.0},
        PointLight((0.25, -0.3, -1.1), a0=1.0, falloff="inverse-square", radius=0.001),
    ),
}


SIZED: dict[str, tuple[dict[str, Any], SphereLight | AreaLight]] = {
    "sphere": (
        {"kind": "sphere", **FADE, "position": INSIDE, "a0": 1.0, "size": 0.15},
        SphereLight(INSIDE, a0=1.0, size=0.15, falloff="inverse-square"),
    ),
    "area": (
        {"kind": "area", "position": INSIDE, "target": [1.1, 0.8, 0], "width": 0.5, "height": 0.2, "turn": 0, "a0": 1.0},
        AreaLight(INSIDE, u=(0.5, 0, 0), v=(0, -0.2, 0)),
    ),
}


@pytest.fixture
def glossy(make_asset: Callable[..., Asset]) -> Asset:
    """Indirect maps of a view straight down on a plane, glossy in half of it and translucent in the other, below a small ball."""
    occluder = ball(0.15, [0.95, -0.3, 0.75], 24)  # no ray of the camera meets it
    receivers = build_plane(occluder, size=SIDE, albedo=(0.3, 0.2, 0.1))
    plain = {"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1]}, "doubleSided": True}
    ground = quad([-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0])
    made = make_asset(k=4, height=SIDE, width=SIDE, encoding="half", position=False)
    columns = np.broadcast_to(np.arange(SIDE)[None, :, None] / SIDE, (SIDE, SIDE, 3))
    color = np.where(columns > 0.3, [0.5, 0.4, 0.3], 0).astype(np.float32)
    lobe = np.stack([0.2 + 0.4 * columns[::-1, :, 0].T, columns[..., 0], columns[..., 0] > 0.3], axis=2).astype(np.float32)
    through = np.where(columns < 0.3, [0.1, 0.5, 0.3], 0).astype(np.float32)
    images = {**receivers.images, "coverage": np.ones((SIDE, SIDE), np.float32), "glossy": color, "lobe": lobe, "transmission": through}
    names = {"transport": "indirect", "quantity": "radiance", "scene": "scene.glb", "receiver": {"kind": "view", "camera": "Camera"}}
    scene = scene_glb(("Ground", ground, plain), ("Ball", occluder, plain))
    return complete(replace(made, images=images, scene=scene), **names, direct={"sun_angle": 0.0, "camera": CAMERA})


@pytest.mark.parametrize("kind", OVER)
def test_lobes_and_backs_show_direct_light_as_rays_say(
    chromium: Any, glossy: Asset, serve: Callable[..., str], tmp_path: Path, kind: str
) -> None:
    glossy.save(tmp_path / "asset")
    state, light = OVER[kind]
    expected = direct_light(glossy, [light])
    bare = {name: image for name, image in glossy.images.items() if name not in ("lobe", "transmission")}
    diffuse = direct_light(replace(glossy, images=bare), [light])
    assert np.quantile(np.abs(shown_as(expected) - shown_as(diffuse)), 0.9) > 10
    lights = [{**COMMON, **state}]
    hashed = json.dumps({"zoom": ZOOM, "middle": [SIDE / 2, SIDE / 2], "terms": "direct", "exposure": 0, "lights": lights, "selected": -1})
    chromium("open", url=f"{serve(tmp_path / 'asset')}#{quote(hashed)}", width=WIDTH, height=HEIGHT)
    apart = np.abs(saved(chromium, tmp_path) - shown_as(expected))
    assert np.quantile(apart, 0.9) <= APART, np.quantile(apart, [0.5, 0.9, 0.95, 1])
    assert apart.mean() <= MEAN


@pytest.fixture(scope="module")
def shaped(tmp_path_factory: pytest.TempPathFactory) -> Asset:
    """A deep framebuffer whose scene has lights with an IES file."""
    room = Room.box((3, 2, 2), 0.25, 0.6)
    asset = DeepFramebuffer().encode(view_of_room(tmp_path_factory.mktemp("view") / "capture", room, 700, 150, tested=0))
    common = {"position": [1.2, 0.9, 1.3], "color": [1.0, 0.8, 0.6], "a0": 0.7, "falloff": "inverse-square", "profile": "Fixture.ies"}
    fixture = {"kind": "point", **common, "direction": [0.6, 0.3, -0.8], "roll": 0.7}
    spot = {"kind": "spot", **common, "direction": [-0.5, 0.0, -1.0], "inner": 0.6, "outer": 0.9, "roll": -0.4}
    own = {
        "scene_lights": [{"name": "Fixture", "light": fixture}, {"name": "Spot", "light": spot}],
        "scene_profiles": {"Fixture.ies": UNEVEN},
    }
    return replace(asset, manifest={**asset.manifest, **own, "direct": {"sun_angle": 0.0, "footprint": 1e-3}})


@pytest.mark.parametrize("kind", SIZED)
def test_lobes_reflect_lights_with_a_size(chromium: Any, shaped: Asset, serve: Callable[..., str], tmp_path: Path, kind: str) -> None:
    """In a room without anything between, beside the mean over many places of the light, each as a point."""
    rng = np.random.default_rng(5)
    shape = (shaped.height, shaped.width)
    color = np.broadcast_to(np.float32(0.5), (*shape, 3)).copy()
    lobe = np.stack([rng.uniform(0.2, 0.7, shape), rng.uniform(0, 1, shape), np.ones(shape)], axis=2).astype(np.float32)
    matrix = np.eye(4)
    matrix[:3, 3] = (2.4, 1.4, 1.2)
    direct = {**shaped.manifest["direct"], "camera": {**CAMERA, "matrix_world": matrix.tolist()}}
    manifest = {**shaped.manifest, "direct": direct, "glossy": "glossy.exr", "lobe": "lobe.exr"}
    asset = replace(shaped, manifest=manifest, images={**shaped.images, "glossy": color, "lobe": lobe})
    asset.save(tmp_path / "asset")
    state, light = SIZED[kind]
    pixels = GlossyPixels(Receivers.of(asset))
    points, normals, albedo = (asset.images[name].reshape(-1, 3)[pixels.texels] for name in ("position", "normal", "albedo"))
    square = (np.arange(SAMPLES)[:, None] * np.array(GOLDEN)) % 1
    lobes = np.zeros((len(points), 3))
    for place in square:
        rays = rays_towards(light, points, normals, 0.0, partial(np.broadcast_to, place, (len(points), 2)))
        NoL = np.maximum(np.einsum("nc,nc->n", normals, rays.direction), 1e-4)
        reflected = pixels.reflected(pixels.texels, points, normals, rays.direction.astype(np.float64))
        lobes += reflected * (rays.irradiance * rays.importance / NoL)[:, None] * rays.opening / SAMPLES
    diffuse = irradiance_from(light, points, normals)[:, None] * albedo / np.pi
    lights = [{**COMMON, **state}]
    hashed = json.dumps({"zoom": ZOOM, "middle": [asset.width / 2, asset.height / 2], "terms": "direct", "exposure": 0, "lights": lights})
    chromium("open", url=f"{serve(tmp_path / 'asset')}#{quote(hashed)}", width=WIDTH, height=HEIGHT)
    apart = np.abs(saved(chromium, tmp_path).reshape(-1, 3)[pixels.texels] - shown_as(diffuse + lobes))
    assert np.quantile(apart, 0.95) <= APART, np.quantile(apart, [0.5, 0.9, 0.95, 1])
    assert np.quantile(shown_as(diffuse + lobes) - shown_as(diffuse), 0.9) > 10


def test_sizes_and_angles_are_set_and_saved(chromium: Any, shaped: Asset, serve: Callable[..., str], tmp_path: Path) -> None:
    """Of a spot, which is a point without a size, and of a sun, which has the asset's angle unless it has one."""
    shaped.save(tmp_path / "asset")
    spot = {"kind": "spot", **COMMON, **FADE, "position": INSIDE, "target": [1.4, 1.0, 0.0], "a0": 1.0, "inner": 30, "outer": 35}
    sun = {"kind": "directional", **COMMON, "direction": [0.1, 0.2, 1.0]}
    state = {"lights": [spot, sun], "selected": 0}
    chromium("open", url=f"{serve(tmp_path / 'asset')}#{quote(json.dumps(state))}", width=WIDTH, height=HEIGHT)
    ((before, far),) = lights_of(chromium, tmp_path)
    assert isinstance(before, SpotLight) and before.size == 0 and isinstance(far, DirectionalLight) and far.angle is None
    chromium("number", name="Size (m)", value=0.05)
    chromium("press", keys=["2"])
    chromium("number", name="Angle (°)", value=2)
    ((soft, wide),) = lights_of(chromium, tmp_path)
    assert isinstance(soft, SpotLight) and soft.size == 0.05 and soft.radius == 0.05
    chromium("press", keys=["1"])
    chromium("number", name="Size (m)", value=0)
    frames = json.loads(chromium.file("Lights (FRAMES.json)"))["frames"]
    assert frames[0]["lights"][0]["size"] == 0, "said, so that a rig sets it"
    assert isinstance(wide, DirectionalLight) and wide.angle == pytest.approx(np.radians(2))


@pytest.mark.parametrize("terms", ["indirect", "direct"])
def test_a_profile_of_the_scene_shapes_light(chromium: Any, shaped: Asset, serve: Callable[..., str], tmp_path: Path, terms: str) -> None:
    """The scene's own lights, with their files; FRAMES.json names these, and `srbf relight` finds them in the asset."""
    shaped.save(tmp_path / "asset")
    where: dict[str, Any] = {
        "position": (1.2, 0.9, 1.3),
        "color": (1.0, 0.8, 0.6),
        "a0": 0.7,
        "falloff": "inverse-square",
        "profile": uneven,
    }
    lights: list[Light] = [
        PointLight(**where, direction=(0.6, 0.3, -0.8), roll=0.7),
        SpotLight(**where, direction=(-0.5, 0.0, -1.0), inner=0.6, outer=0.9, roll=-0.4),
    ]
    hashed = quote(json.dumps({"zoom": ZOOM, "middle": [shaped.width / 2, shaped.height / 2], "terms": terms, "exposure": 0}))
    chromium("open", url=f"{serve(tmp_path / 'asset')}#{hashed}", width=WIDTH, height=HEIGHT)

    def pictures(one: list[Light]) -> np.ndarray:
        if terms == "indirect":
            return relight(shaped, one)
        return direct_light(shaped, one)

    plain: list[Any] = [replace(light, profile=None) for light in lights if isinstance(light, PointLight)]
    expected, even = pictures(lights), pictures(plain)
    covered = shaped.images["coverage"] > 0.5
    apart = np.abs(saved(chromium, tmp_path) - shown_as(expected))[covered]
    assert np.quantile(apart, 0.95) <= SHAPED, np.quantile(apart, [0.5, 0.9, 0.95, 1])
    assert np.quantile(np.abs(shown_as(even) - shown_as(expected))[covered], 0.5) > 3 * SHAPED
    (found,) = lights_of(chromium, tmp_path, known=shaped)
    np.testing.assert_allclose(pictures(found), expected, atol=1e-3 * expected.max())


@pytest.mark.parametrize("terms", ["indirect", "direct"])
def test_a_given_image_is_projected(chromium: Any, shaped: Asset, serve: Callable[..., str], tmp_path: Path, terms: str) -> None:
    """Chosen in the panel; FRAMES.json names the file, which `srbf relight` finds beside it."""
    write_picture(tmp_path / "gobo.png", picture())
    gobo = read_profile(tmp_path / "gobo.png")
    shaped.save(tmp_path / "asset")
    spot = {"kind": "spot", **COMMON, **FADE, "position": INSIDE, "target": [1.4, 1.0, 0.0], "a0": 1.0, "inner": 30, "outer": 35}
    state = {"zoom": ZOOM, "middle": [shaped.width / 2, shaped.height / 2], "terms": terms, "exposure": 0, "lights": [spot], "selected": 0}
    url = serve(tmp_path / "asset", profiles=[gobo])
    chromium("open", url=f"{url}#{quote(json.dumps(state))}", width=WIDTH, height=HEIGHT)
    plain = saved(chromium, tmp_path)
    chromium("choose", selector=".lil-gui .controller:has(.name:text-is('Profile')) select", value="gobo.png")
    chromium("number", name="Turn of the profile (°)", value=30)
    found = saved(chromium, tmp_path)
    path = tmp_path / "FRAMES.json"
    path.write_bytes(chromium.file("Lights (FRAMES.json)"))
    ((light,),) = read_frames(path)
    assert isinstance(light, SpotLight) and light.profile == gobo and light.roll == pytest.approx(np.radians(30))
    expected = relight(shaped, [light]) if terms == "indirect" else direct_light(shaped, [light])
    covered = shaped.images["coverage"] > 0.5
    apart = np.abs(found - shown_as(expected))[covered]
    assert np.quantile(apart, 0.95) <= SHAPED, np.quantile(apart, [0.5, 0.9, 0.95, 1])
    lit = covered & (plain.max(axis=2) > (0.1 if terms == "direct" else 0.5) * plain.max())
    assert np.quantile(np.abs(plain - found)[lit], 0.5) > 2 * SHAPED


def test_the_command_takes_profiles(built: Path, shaped: Asset, tmp_path: Path) -> None:
    write_picture(tmp_path / "gobo.png", picture())
    (tmp_path / "Own.ies").write_text(UNEVEN)
    shaped.save(tmp_path / "asset")
    words = [
        "view",
        tmp_path / "asset",
        "--profile",
        tmp_path / "gobo.png",
        "--profile",
        tmp_path / "Own.ies",
        "--save",
        tmp_path / "page.html",
    ]
    done = CliRunner().invoke(app, [str(word) for word in words])
    assert done.exit_code == 0, done.output
    held = json.loads((tmp_path / "page.html").read_text().split('id="held">')[1].split("</script>")[0])
    (facts,) = json.loads(base64.b64decode(held["viewer.json"]))["assets"]
    assert {name: told["projected"] for name, told in facts["profiles"].items()} == {
        "Fixture.ies": False,
        "gobo.png": True,
        "Own.ies": False,
    }
    assert all(told["file"] in held for told in facts["profiles"].values())
    done = CliRunner().invoke(app, [str(word) for word in [*words[:3], tmp_path / "none.ies"]])
    assert done.exit_code == 1 and "expected an IES file, found none" in done.output


def test_a_light_whose_profile_is_not_there_shines_without(chromium: Any, shaped: Asset, serve: Callable[..., str], tmp_path: Path) -> None:
    """Its name, with an apostrophe, outlives the address; the panel can take it off."""
    shaped.save(tmp_path / "asset")
    light = {"kind": "point", **COMMON, **FADE, "position": INSIDE, "a0": 1.0, "profile": "it's gone.ies"}
    hashed = quote(json.dumps({"terms": "indirect", "lights": [light], "selected": 0}), safe="")
    chromium("open", url=f"{serve(tmp_path / 'asset')}#{hashed}", width=WIDTH, height=HEIGHT)
    assert "shine without it's gone.ies" in chromium("run", script="document.getElementById('status').textContent")
    chromium("number", name="Intensity", value=2)
    assert chromium.state()["lights"][0]["profile"] == "it's gone.ies"
    chromium("choose", selector=".lil-gui .controller:has(.name:text-is('Profile')) select", value="None")
    assert "profile" not in chromium.state()["lights"][0]
    assert "shine without" not in chromium("run", script="document.getElementById('status').textContent")


def test_profiles_are_of_lights_inside_and_of_one_name_each(shaped: Asset, glossy: Asset, tmp_path: Path) -> None:
    shaped.save(tmp_path / "shot")
    glossy.save(tmp_path / "distant")
    with pytest.raises(InputError, match="expected profiles of different names, found two of Fixture.ies; rename the file"):
        contents_of([tmp_path / "shot"], profiles=[replace(uneven, file=("Fixture.ies", b""))])
    with pytest.raises(InputError, match="expected profiles of different names, found two of uneven.ies; rename the file"):
        contents_of([tmp_path / "shot"], profiles=[uneven, uneven])
    with pytest.raises(InputError, match="expected an asset of lights inside the scene for profiles, found relighting-map"):
        contents_of([tmp_path / "distant"], profiles=[uneven])


def test_a_render_takes_given_profiles_by_name(shaped: Asset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shaped.save(tmp_path / "asset")
    (tmp_path / "shot.blend").write_bytes(b"")
    own = replace(uneven, file=("Own.ies", b"IES"))
    renders = CyclesRenders(Asset.open(tmp_path / "asset"), tmp_path / "shot.blend", profiles=[own])
    begun: list[list[Light]] = []
    monkeypatch.setattr(renders, "_render", lambda number, lights, samples, halt: begun.append(lights))
    light = {"kind": "point", "position": [0, 0, 1], "profile": "Own.ies"}
    status, said = renders.start(json.dumps({"lights": [light], "samples": 1}).encode())
    renders.stop()
    assert status == HTTPStatus.ACCEPTED, said
    ((found,),) = begun
    assert isinstance(found, PointLight) and found.profile == own


def test_a_render_takes_profiles_of_the_scene_alone(shaped: Asset, tmp_path: Path) -> None:
    shaped.save(tmp_path / "asset")
    (tmp_path / "shot.blend").write_bytes(b"")
    renders = CyclesRenders(Asset.open(tmp_path / "asset"), tmp_path / "shot.blend")
    light = {"kind": "point", "position": [0, 0, 1], "profile": "../Other.ies"}
    status, said = renders.start(json.dumps({"lights": [light], "samples": 1}).encode())
    assert status == HTTPStatus.BAD_REQUEST and "expected a profile of the asset's scene (Fixture.ies)" in said["error"]


def direct_light(asset: Asset, lights: list[Light]) -> np.ndarray:
    """By rays."""
    with Added(asset, "ray") as added:
        found = added.response(lights)
    assert found is not None
    return found


def saved(chromium: Any, folder: Path) -> np.ndarray:
    """The page's picture, (H, W, 3) bytes."""
    (folder / "saved.png").write_bytes(chromium.file("Picture (PNG)"))
    return read_image(folder / "saved.png", 3) * 255
