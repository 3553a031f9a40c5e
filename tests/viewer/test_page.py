"""The page in a browser: what is dragged, typed, dropped and pressed is what numpy relights by, pixel for pixel."""

from __future__ import annotations

import base64
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_assets import build_neural
from typer.testing import CliRunner
from web_assets import complete, on_a_plane

from srbf.asset import Asset
from srbf.cli import app
from srbf.cli.light_arguments import read_frames
from srbf.io.image import encode_srgb, read_image, write_image
from srbf.lights import DirectionalLight, EnvironmentLight, Light
from srbf.methods import linear_response, relight
from srbf.relighting.scene_lights import profiles_of

ZOOM = 16
WIDTH, HEIGHT = 800, 520
PANEL = 312
STEP = 0.5 + 0.02  # of a byte: rounding, and what sRGB's power is off by in single precision
PICTURE = f"#{{'zoom':{ZOOM},'middle':[7,4.5]"


def shown_as(image: np.ndarray, exposure: float = 0.0) -> np.ndarray:
    """What the linear tone shows of a picture, 0 to 255, not rounded."""
    return encode_srgb(np.clip(image * 2.0**exposure, 0, 1)) * 255


def shows(chromium: Any, asset: Asset, lights: list[Light], exposure: float = 0.0) -> bool:
    expected = shown_as(relight(asset, lights), exposure)
    assert np.ptp(expected) > 100
    return bool((np.abs(chromium.texels(asset.width, asset.height, ZOOM) - expected) <= STEP).all())


def lights_of(chromium: Any, folder: Path, button: str = "Lights (FRAMES.json)", known: Asset | None = None) -> list[list[Light]]:
    """`known`: the asset whose scene's profiles they may have."""
    path = folder / "FRAMES.json"
    path.write_bytes(chromium.file(button))
    return read_frames(path, known=None if known is None else profiles_of(known))


@pytest.fixture
def asset(make_asset: Callable[..., Asset]) -> Asset:
    return complete(on_a_plane(make_asset(k=7, encoding="half", ambient=True)))


@pytest.fixture
def url(asset: Asset, tmp_path: Path, serve: Callable[..., str]) -> str:
    asset.save(tmp_path / "asset")
    return serve(tmp_path / "asset")


def test_a_directional_light_dragged_over_the_disc_relights(chromium: Any, asset: Asset, url: str) -> None:
    chromium("open", url=url + PICTURE + "}", width=WIDTH, height=HEIGHT)
    before = chromium.state()["lights"][0]["direction"]
    assert shows(chromium, asset, [DirectionalLight(tuple(before))])
    x, y, w, h = chromium(
        "run", script="(b => [b.x, b.y, b.width, b.height])(document.getElementById('directions').getBoundingClientRect())"
    )
    middle = [x + w / 2, y + h / 2]
    chromium("drag", path=[[middle[0] - 40, middle[1] + 30], [middle[0] + 10, middle[1] - 20], [middle[0] + 55, middle[1] - 5]])
    light = chromium.state()["lights"][0]["direction"]
    radius = min(w, h) / 2 - 12
    tilt = 2 * np.arcsin(np.hypot(55, 5) / radius * np.sin(np.radians(54)))  # equal areas; the rim is 18 degrees below the horizon
    expected = np.array([np.sin(tilt) * 55 / np.hypot(55, 5), np.sin(tilt) * 5 / np.hypot(55, 5), np.cos(tilt)])
    assert np.abs(np.array(light) - expected).max() < 0.01, "the light is not where the pointer let it go"
    assert shows(chromium, asset, [DirectionalLight(tuple(light))])


@pytest.mark.parametrize("kind", ["relighting-map", "eigen-map", "clustered-eigen-map", "neural-map"])
def test_point_lights_and_suns_together_are_numpys(
    chromium: Any, make_asset: Callable[..., Asset], make_planes: Callable[..., Asset], serve: Callable[..., str], tmp_path: Path, kind: str
) -> None:
    """Typed into the panel; each light's color and falloff its own."""
    made = {
        "relighting-map": lambda: make_asset(k=6),
        "eigen-map": lambda: make_planes(components=5),
        "clustered-eigen-map": lambda: make_planes(components=5, clusters=4),
        "neural-map": build_neural,
    }
    asset = complete(on_a_plane(made[kind]()))
    asset.save(tmp_path / "asset")
    chromium("open", url=serve(tmp_path / "asset") + PICTURE + ",'exposure':-1}", width=WIDTH, height=HEIGHT)
    chromium("number", name="Intensity", value=0.4)
    chromium("choose", selector=".chip.add", value="point")
    for name, value in {
        "Position x (m)": 0.3,
        "Position y (m)": -0.4,
        "Position z (m)": 0.9,
        "a₀ (m)": 0.8,
        "Intensity": 0.7,
    }.items():
        chromium("number", name=name, value=value)
    chromium("choose", selector=".chip.add", value="spot")
    for name, value in {
        "Position x (m)": -0.5,
        "Position z (m)": 1.25,
        "Aim x (m)": 0.5,
        "Inner half-angle (°)": 12,
        "Outer half-angle (°)": 35,
    }.items():
        chromium("number", name=name, value=value)
    (lights,) = lights_of(chromium, tmp_path)
    assert [type(light).__name__ for light in lights] == ["DirectionalLight", "PointLight", "SpotLight"]
    assert lights[1].position == (0.3, -0.4, 0.9)  # type: ignore[union-attr]
    assert shows(chromium, asset, lights, exposure=-1)


def test_an_address_brings_everything_back(chromium: Any, asset: Asset, url: str) -> None:
    chromium("open", url=url + PICTURE + ",'tone':'agx','exposure':0.5}", width=WIDTH, height=HEIGHT)
    chromium("choose", selector=".chip.add", value="point")
    chromium("number", name="Position x (m)", value=0.31)
    chromium("press", keys=["1", "ArrowLeft", "Shift+ArrowUp"])
    there, seen = chromium("address"), chromium.texels(asset.width, asset.height, ZOOM)
    kept = chromium.state()
    chromium("open", url=url, width=WIDTH, height=HEIGHT)
    assert "agx" not in chromium("address")
    chromium("open", url=there, width=WIDTH, height=HEIGHT)
    assert (chromium.texels(asset.width, asset.height, ZOOM) == seen).all()
    chromium("press", keys=["?", "?"])  # any key: the address is written again
    assert chromium.state() == kept


def test_an_address_of_nonsense_is_said_in_one_line(chromium: Any, asset: Asset, url: str) -> None:
    chromium("open", url=url, width=WIDTH, height=HEIGHT)
    for hash_, expected in {
        "#{": "expected a state",
        "#{'tone':'loud'}": "another tone",
        "#{'lights':[{'kind':'point'}]}": "of on",
    }.items():
        chromium("address")  # once the page has written its own
        went = "addEventListener('hashchange', () => done(), {once: true})"
        waited = f"new Promise((done) => {{ {went}; location.hash = {json.dumps(hash_)}; }})"
        chromium("run", script=waited)
        assert expected in chromium("run", script="document.getElementById('toast').textContent")
    assert np.ptp(chromium.canvas()) > 200, "the picture is still there"


def test_keys_move_the_sun_and_play_its_path(chromium: Any, asset: Asset, url: str) -> None:
    chromium("open", url=url, width=WIDTH, height=HEIGHT)
    before = np.array([-0.45, -0.5, 0.74])
    chromium("press", keys=["ArrowLeft"])
    x, y, _ = chromium.state()["lights"][0]["direction"]
    turned = np.degrees(np.arctan2(y, x) - np.arctan2(before[1], before[0])) % 360
    assert turned == pytest.approx(2, abs=0.01)
    chromium("press", keys=["Shift+ArrowDown"])
    assert np.degrees(np.arcsin(chromium.state()["lights"][0]["direction"][2])) == pytest.approx(
        np.degrees(np.arcsin(before[2] / np.linalg.norm(before))) - 10, abs=0.01
    )
    still = chromium.state()["lights"][0]["direction"]
    chromium("run", script="window.dispatchEvent(new KeyboardEvent('keydown', {key: ' '}))")
    chromium("run", script="new Promise((done) => setTimeout(done, 500))")
    chromium("press", keys=[" "])
    went = chromium.state()
    assert not went["playing"]
    assert went["lights"][0]["direction"] != still
    assert went["lights"][0]["direction"][2] == pytest.approx(still[2], abs=1e-4), "a turn keeps its elevation"


def test_what_is_saved_is_what_is_seen_and_what_the_command_relights(chromium: Any, asset: Asset, url: str, tmp_path: Path) -> None:
    chromium("open", url=url + PICTURE + ",'exposure':-0.5}", width=WIDTH, height=HEIGHT)
    chromium("choose", selector=".chip.add", value="spot")
    png, frames = tmp_path / "saved.png", tmp_path / "FRAMES.json"
    png.write_bytes(chromium.file("Picture (PNG)"))
    saved = np.round(read_image(png, 3) * 255).astype(np.uint8)
    assert saved.shape == (asset.height, asset.width, 3)
    assert (saved == chromium.texels(asset.width, asset.height, ZOOM)).all()
    frames.write_bytes(chromium.file("Lights (FRAMES.json)"))
    done = CliRunner().invoke(app, ["relight", str(tmp_path / "asset"), "--lights", str(frames), "-o", str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    assert (np.abs(saved - shown_as(read_image(tmp_path / "out" / "0000.exr", 3), -0.5)) <= STEP).all()


def test_a_saved_path_is_a_round(chromium: Any, asset: Asset, url: str, tmp_path: Path) -> None:
    chromium("open", url=url + "#{'path':'turn','seconds':2}", width=WIDTH, height=HEIGHT)
    frames = lights_of(chromium, tmp_path, "Path (FRAMES.json)")
    azimuths = np.unwrap([np.arctan2(light.direction[1], light.direction[0]) for (light,) in frames])  # type: ignore[union-attr]
    assert len(frames) == 48
    assert np.degrees(np.diff(azimuths)) == pytest.approx(np.full(47, 7.5), abs=0.01)


def test_a_swing_goes_over_the_zenith_and_back(chromium: Any, asset: Asset, url: str, tmp_path: Path) -> None:
    """In the plane of the sun's azimuth, 75 degrees to either side, from the sun's own direction."""
    chromium("open", url=url + "#{'path':'swing','seconds':3}", width=WIDTH, height=HEIGHT)
    directions = np.array([light.direction for (light,) in lights_of(chromium, tmp_path, "Path (FRAMES.json)")])  # type: ignore[union-attr]
    start = np.array([-0.45, -0.5, 0.74]) / np.linalg.norm([-0.45, -0.5, 0.74])
    assert directions[0] == pytest.approx(start, abs=1e-4)
    assert directions @ np.cross(start, [0, 0, 1]) == pytest.approx(np.zeros(72), abs=1e-4)
    tilt = np.degrees(np.arctan2(directions @ [start[0], start[1], 0] / np.hypot(start[0], start[1]), directions[:, 2]))
    assert (tilt.max(), tilt.min()) == pytest.approx((75, -75), abs=0.2)


@pytest.mark.parametrize("suffix", ["exr", "png", "hdr"])
def test_an_environment_dropped_on_the_page_lights_it(chromium: Any, asset: Asset, url: str, tmp_path: Path, suffix: str) -> None:
    environment = np.random.default_rng(4).random((8, 16, 3)).astype(np.float32)
    path = tmp_path / f"environment.{suffix}"
    if suffix == "hdr":
        write_radiance(path, environment)
    else:
        write_image(
            path, np.round(environment * 255).astype(np.uint8) if suffix == "png" else environment, "uint8" if suffix == "png" else "float"
        )
    chromium("open", url=url + PICTURE + ",'exposure':-2}", width=WIDTH, height=HEIGHT)
    chromium("drop", name=path.name, bytes=base64.b64encode(path.read_bytes()).decode())
    assert [light["on"] for light in chromium.state()["lights"]] == [False, True], "the first environment map turns the sun off"
    assert shows(chromium, asset, [EnvironmentLight(read_image(path, 3))], exposure=-2)
    (lights,) = lights_of(chromium, tmp_path)  # beside the picture
    assert shows(chromium, asset, lights, exposure=-2)


def test_given_environments_shine_from_the_start(chromium: Any, asset: Asset, built: Path, tmp_path: Path) -> None:
    """The first of them, in one file; an address that names the second is no riddle."""
    maps = [np.random.default_rng(seed).random((8, 16, 3)).astype(np.float32) for seed in (4, 5)]
    asset.save(tmp_path / "asset")
    flags = []
    for i, pixels in enumerate(maps):
        write_image(tmp_path / f"around {i}.exr", pixels, "float")
        flags += ["--environment", str(tmp_path / f"around {i}.exr")]
    page = tmp_path / "page.html"
    done = CliRunner().invoke(app, ["view", str(tmp_path / "asset"), "--save", str(page), *flags])
    assert done.exit_code == 0, done.output
    chromium("open", url=page.as_uri() + PICTURE + ",'exposure':-2}", width=WIDTH, height=HEIGHT)
    assert shows(chromium, asset, [EnvironmentLight(maps[0])], exposure=-2)
    second = "'lights':[{'kind':'environment','on':true,'color':'%23ffffff','intensity':1,'file':'around%201.exr'}]"
    chromium("open", url=page.as_uri() + PICTURE + f",'exposure':-2,'path':'turn','seconds':1,{second}}}", width=WIDTH, height=HEIGHT)
    assert shows(chromium, asset, [EnvironmentLight(maps[1])], exposure=-2)
    chromium("number", name="Turn (°)", value=50)
    assert shows(chromium, asset, [EnvironmentLight(maps[1]).turned(np.radians(50))], exposure=-2)
    frames = lights_of(chromium, tmp_path, "Path (FRAMES.json)")
    assert len(frames) == 24
    assert shows(chromium, asset, frames[0], exposure=-2)
    sixth = relight(asset, frames[6])
    np.testing.assert_allclose(sixth, relight(asset, [EnvironmentLight(maps[1]).turned(np.radians(140))]), atol=1e-3 * sixth.max())
    told = {"frames": [json.loads((tmp_path / "FRAMES.json").read_text())["frames"][6]]}
    chromium("drop", name="FRAMES.json", bytes=base64.b64encode(json.dumps(told).encode()).decode())
    assert chromium.state()["lights"][0]["turn"] == pytest.approx(140)
    assert shows(chromium, asset, frames[6], exposure=-2)
    again = CliRunner().invoke(app, ["view", str(tmp_path / "asset"), "--save", str(tmp_path / "b.html"), *flags[:2], *flags[:2]])
    assert again.exit_code == 1
    assert "two of around 0.exr" in again.output


def write_radiance(path: Path, environment: np.ndarray) -> None:
    """Flat RGBE pixels [Ward1991]: mantissas that share an exponent."""
    exponent = np.ceil(np.log2(environment.max(axis=2)))
    mantissa = np.clip(np.floor(environment / 2.0 ** exponent[..., None] * 256), 0, 255)
    pixels = np.concatenate([mantissa, exponent[..., None] + 128], axis=2).astype(np.uint8)
    height, width = environment.shape[:2]
    path.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n" + f"-Y {height} +X {width}\n".encode() + pixels.tobytes())


def test_files_that_are_no_environment_are_refused_in_one_line(chromium: Any, asset: Asset, url: str) -> None:
    chromium("open", url=url, width=WIDTH, height=HEIGHT)
    for name, expected in {
        "environment.gif": "as .exr, .hdr or .png",
        "environment.exr": "cannot read environment.exr",
        "environment.hdr": "cannot read environment.hdr",
    }.items():
        chromium("drop", name=name, bytes=base64.b64encode(b"not a picture").decode())
        assert expected in chromium("run", script="document.getElementById('toast').textContent")
    assert chromium("run", script="document.querySelectorAll('#chips .chip').length") == 2, "the sun, and the list to add others from"


def test_values_below_zero_are_shown_where_numpy_has_them(chromium: Any, asset: Asset, url: str) -> None:
    chromium("open", url=url + PICTURE + ",'show':'negative'}", width=WIDTH, height=HEIGHT)
    seen = chromium.texels(asset.width, asset.height, ZOOM).astype(int)
    magenta = (seen[..., 0] > seen[..., 1] + 40) & (seen[..., 2] > seen[..., 1] + 40)
    least = linear_response(asset, [DirectionalLight((-0.45, -0.5, 0.74))]).min(axis=2)
    sure = np.abs(least) > 2e-3
    assert sure.mean() > 0.9
    assert (magenta == (least < 0))[sure].all()


def test_a_map_is_shown_signed(chromium: Any, asset: Asset, url: str) -> None:
    """Blue below 0, red above; which of them says the sign of its luminance."""
    chromium("open", url=url + PICTURE + ",'show':'map','map':4}", width=WIDTH, height=HEIGHT)
    for index in (4, 5):
        seen = chromium.texels(asset.width, asset.height, ZOOM).astype(int)
        value = asset.coefficients()[index] @ np.array([0.2126, 0.7152, 0.0722], np.float32)
        sure = np.abs(value) > 0.1
        assert ((seen[..., 0] > seen[..., 2]) == (value > 0))[sure].all()
        chromium("press", keys=["m"])


def test_a_tap_places_a_point_light_above_the_texel(chromium: Any, asset: Asset, url: str) -> None:
    """On a touch screen, twice: above what the position map has there."""
    chromium("open", url=url + PICTURE + "}", width=WIDTH, height=HEIGHT, touch=True)
    row, column = 2, 9
    place = asset.images["position"][row, column]
    assert asset.covered[row, column]
    at = [(WIDTH - PANEL) / 2 + (column - 7 + 0.4) * ZOOM, HEIGHT / 2 + (row - 4.5 + 0.6) * ZOOM]
    chromium("touch", at=at, count=2)
    chromium("press", keys=["2"])
    point_light = chromium.state()["lights"][1]
    assert point_light["kind"] == "point"
    assert point_light["position"][:2] == pytest.approx(place[:2].tolist(), abs=1e-4)
    assert point_light["position"][2] > place[2] + 0.05


def test_a_damaged_asset_is_said_in_one_line(
    chromium: Any, asset: Asset, built: Path, tmp_path: Path, serve_static: Callable[[Path], str]
) -> None:
    """Of an exported site: a file is missing, then one is changed."""
    asset.save(tmp_path / "asset")
    site = tmp_path / "site"
    done = CliRunner().invoke(app, ["export", str(tmp_path / "asset"), "--target", "web", "-o", str(site), "--json"])
    assert done.exit_code == 0, done.output
    there = serve_static(site)
    chromium("open", url=there + PICTURE + "}", width=WIDTH, height=HEIGHT)
    assert shows(chromium, asset, [DirectionalLight((-0.45, -0.5, 0.74))])
    chromium.may_fail = True
    manifest = json.loads((site / "asset.json").read_text())
    victim = site / manifest["maps"][3]["file"]
    data = bytearray(victim.read_bytes())
    data[-1] ^= 1
    victim.write_bytes(data)
    chromium("open", url=there, width=WIDTH, height=HEIGHT)
    assert "checksum" in chromium("run", script="document.querySelector('#loading p').textContent")
    victim.unlink()
    chromium("open", url=there, width=WIDTH, height=HEIGHT)
    text = chromium("run", script="document.querySelector('#loading p').textContent")
    assert victim.name in text
    assert "404" in text
    assert "\n" not in text


def test_one_file_shows_the_same_from_the_disk(chromium: Any, asset: Asset, built: Path, tmp_path: Path) -> None:
    asset.save(tmp_path / "asset")
    page = tmp_path / "room & hall.html"
    done = CliRunner().invoke(app, ["view", str(tmp_path / "asset"), "--save", str(page)])
    assert done.exit_code == 0, done.output
    assert CliRunner().invoke(app, ["view", str(tmp_path / "asset"), "--save", str(page)]).exit_code == 1, "it is not written over"
    shutil.rmtree(tmp_path / "asset")
    chromium("open", url=page.as_uri() + PICTURE + "}", width=WIDTH, height=HEIGHT)
    assert shows(chromium, asset, [DirectionalLight((-0.45, -0.5, 0.74))])


def test_one_file_holds_its_mesh(chromium: Any, built: Path, make_asset: Callable[..., Asset], tmp_path: Path) -> None:
    asset = complete(on_a_plane(make_asset(k=3)), source={"receiver": {"kind": "lightmap", "object": "Table"}})
    asset.save(tmp_path / "asset")
    page = tmp_path / "page.html"
    assert CliRunner().invoke(app, ["view", str(tmp_path / "asset"), "--save", str(page)]).exit_code == 0
    chromium("open", url=page.as_uri(), width=WIDTH, height=HEIGHT)
    assert chromium.state()["view"] == "mesh"
    assert np.ptp(chromium.canvas()[150:400]) > 100
