"""The scene's own lights of a deep framebuffer: their values, their energies in Cycles, and relighting by them against Cycles."""

from __future__ import annotations

import json
import tempfile
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from light_set_commands import done, refused, scenes_in

from srbf.asset import Asset
from srbf.bake.given_reference import StoppedError, changed_line, render_given
from srbf.bake.job import base_job
from srbf.bake.request import RenderRequest
from srbf.bake.settings import BakeSettings, Receiver
from srbf.bake.worker import Worker
from srbf.io.image import read_image
from srbf.lights import AreaLight, DirectionalLight, PointLight, SphereLight, SpotLight
from srbf.relighting.scene_lights import scene_lights

pytest.importorskip("embreex")
pytestmark = pytest.mark.blender

SIDE = 48
VIEW = ["--receiver", "view", "--size", f"{SIDE}x{SIDE}", "--light-set", "gather", "--pool", "8000", "--seed", "77", "--holdout", "0"]
ENERGY = 0.02  # of each light, by Cycles as the scene has it and as its values say: both have noise
PICTURE = 0.05  # relative RMSE of a picture under all lights
SAMPLES, FEW = 192, 48  # of pictures of all lights, and of one
DISK = np.sqrt(np.pi) / 2


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    return scenes_in(tmp_path_factory)


@pytest.fixture(scope="module")
def shot(scene: Callable[[str], Path], tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The folder of the capture and the asset of the designed room, and what the bake said."""
    folder = tmp_path_factory.mktemp("shot")
    return folder, baked(scene("designed"), folder)


def baked(scene: Path, folder: Path) -> str:
    """Bake a scene's view into the folder's `capture`, fit it into its `asset`; what the bake said."""
    said = done("bake", scene, "-o", folder / "capture", *VIEW).stderr
    done("fit", folder / "capture", "-o", folder / "asset")
    return said


def each_by_cycles(scene: Path, names: Sequence[str], samples: int) -> list[np.ndarray]:
    """(H, W, 3) of each of the scene's own lights."""
    lights = [{"index": i, "kind": "named", "name": name} for i, name in enumerate(names)]
    asked = [RenderRequest(None, samples, 5).message() | {"light": light} for light in lights]
    return _rendered(scene, {"requests": asked, "lit_by": {"kind": "named", "groups": []}})


def by_cycles(scene: Path, samples: int) -> np.ndarray:
    """(H, W, 3): the scene's own lights as designed."""
    own = {"ambient": RenderRequest(None, samples, 5).message(), "keep_scene_lights": True, "lit_by": {"kind": "own"}, "requests": []}
    (image,) = _rendered(scene, own)
    return image


def _rendered(scene: Path, asked: dict[str, Any]) -> list[np.ndarray]:
    settings, found = BakeSettings(Receiver.parse("view"), SIDE, SIDE, quantity="radiance"), []
    with tempfile.TemporaryDirectory() as name:
        scratch = Path(name)
        with Worker({**base_job(scene, settings, scratch), **asked}, scratch, scratch / "bake.log", None) as worker:
            for event in worker.events(lambda line: None):
                if event["event"] == "rendered":
                    found.append(np.load(scratch / event["files"]["response"])[:, :, :3])
                elif event["event"] == "image" and event["name"] == "ambient":
                    found.append(np.load(scratch / event["file"])[:, :, :3])
    return found


def relative(image: np.ndarray, reference: np.ndarray) -> float:
    return float(np.sqrt(((image - reference) ** 2).mean() / (reference**2).mean()))


def test_the_lights_are_listed_by_name_with_their_values(shot: tuple[Path, str]) -> None:
    folder, said = shot
    lights = scene_lights(Asset.open(folder / "asset"))
    assert list(lights) == ["Bulb", "Disk", "Globe", "Haze", "Panel", "Spot", "Sun"]
    bulb, disk, globe, haze, panel, spot, sun = lights.values()
    assert type(bulb) is PointLight and bulb.falloff == "inverse-square" and bulb.position == pytest.approx((0.6, 1.4, 1.2))
    np.testing.assert_allclose(bulb.color, 14 / (4 * np.pi) * np.array([1, 0.8, 0.5]), rtol=1e-5)
    assert isinstance(globe, SphereLight) and globe.size == pytest.approx(0.08)
    assert isinstance(spot, SpotLight) and spot.outer == pytest.approx(0.55) and spot.size == pytest.approx(0.1)
    assert np.cos(spot.inner) == pytest.approx(np.cos(0.55) + 0.4 * (1 - np.cos(0.55)))
    np.testing.assert_allclose(spot.color, 20 * 2 * 1.5 / (4 * np.pi) * np.array([0.4, 1, 0.4]), rtol=1e-5)
    assert isinstance(panel, AreaLight) and panel.area == pytest.approx(0.4 * 0.5 * 0.6, rel=1e-5)
    assert isinstance(disk, AreaLight) and disk.area == pytest.approx(np.pi * 0.15**2, rel=1e-5)
    assert np.linalg.norm(disk.u) == pytest.approx(0.3 * DISK, rel=1e-5)
    assert isinstance(sun, DirectionalLight) and sun.angle == pytest.approx(0.02)
    assert isinstance(haze, DirectionalLight) and haze.angle == pytest.approx(0.5)
    np.testing.assert_allclose(sun.color, 1.2 * np.array([1, 0.9, 0.7]), rtol=1e-5)
    manifest = json.loads((folder / "capture" / "capture.json").read_text())
    assert manifest["direct"]["sun_angle"] == pytest.approx(0.02)
    left = {one["name"]: one["reason"] for one in manifest["scene_lights_left_out"]}
    assert set(left) == {"Portal", "Narrow", "Profile", "Shadowless"}
    assert "world" in left["Portal"] and "spread" in left["Narrow"] and "IES" in left["Profile"] and "shadows" in left["Shadowless"]
    assert "7 lights of the scene's own: 'Bulb', 'Disk'" in said and "'Profile' is left out" in said and "equal area" in said
    told = json.loads(done("info", folder / "asset", "--json").stdout)
    assert told["scene_lights"] == list(lights) and len(told["scene_lights_left_out"]) == 4
    assert "scene lights" in done("info", folder / "capture").stdout


@pytest.mark.slow
def test_each_light_has_its_energy(shot: tuple[Path, str], scene: Callable[[str], Path]) -> None:
    """Made again in Cycles from its values, it lays as much light on the view as the scene's own."""
    asset = Asset.open(shot[0] / "asset")
    lights = asset.manifest["scene_lights"]
    for one, own in zip(lights, each_by_cycles(scene("designed"), [one["name"] for one in lights], FEW), strict=True):
        made = render_given(asset, scene("designed"), [one["light"]], FEW).image
        np.testing.assert_allclose(made.mean(axis=(0, 1)), own.mean(axis=(0, 1)), rtol=ENERGY, err_msg=one["name"])
        assert relative(made, own) < 0.35, one["name"]  # noise of both, most of it at the disk


def test_relighting_by_them_is_what_cycles_renders(shot: tuple[Path, str], scene: Callable[[str], Path], tmp_path: Path) -> None:
    folder, _ = shot
    said = done("relight", folder / "asset", "--scene-lights", "--direct", "ray", "-o", tmp_path / "relit.exr").stderr
    assert "light 'Profile' is left out: its IES texture has no file" in said
    relit = read_image(tmp_path / "relit.exr")[:, :, :3]
    reference = by_cycles(scene("designed"), 2 * SAMPLES)
    assert relative(relit, reference) < PICTURE
    np.testing.assert_allclose(relit.mean(axis=(0, 1)), reference.mean(axis=(0, 1)), rtol=ENERGY)


def test_flags_exclude_each_other_and_an_asset_without_them_says_so(shot: tuple[Path, str], tmp_path: Path) -> None:
    folder, _ = shot
    assert "--scene-lights without other lights" in refused(
        ["relight", folder / "asset", "--scene-lights", "--point", "1,1,1", "-o", tmp_path / "a.exr"], 2
    )
    asset = Asset.open(folder / "asset")
    bare = {key: value for key, value in asset.manifest.items() if not key.startswith("scene_lights")}
    replace(asset, manifest=bare).save(tmp_path / "bare")
    line = refused(["relight", tmp_path / "bare", "--scene-lights", "-o", tmp_path / "a.exr"])
    assert "lists its scene's lights" in line and "--light-set gather" in line


def test_kept_scene_lights_are_ambient_and_not_listed(scene: Callable[[str], Path], tmp_path: Path) -> None:
    small = ["--receiver", "view", "--size", "8x8", "--light-set", "gather", "--pool", "300", "--holdout", "0", "--keep-scene-lights"]
    done("bake", scene("designed"), "-o", tmp_path / "capture", *small)
    told = json.loads((tmp_path / "capture" / "capture.json").read_text())
    assert "ambient" in told and not any(key.startswith("scene_lights") for key in told)


def test_a_render_can_be_stopped_and_a_changed_scene_is_told(shot: tuple[Path, str], scene: Callable[[str], Path]) -> None:
    asset, stop = Asset.open(shot[0] / "asset"), threading.Event()
    lights = [one["light"] for one in asset.manifest["scene_lights"]]
    with pytest.raises(StoppedError):
        threading.Timer(1.0, stop.set).start()
        render_given(asset, scene("designed"), lights, 60_000, stop=stop)
    assert changed_line(asset, scene("designed")) is None
    assert "two different scenes" in str(changed_line(asset, scene("unlit")))


def test_a_relit_picture_is_compared_with_cycles(shot: tuple[Path, str], scene: Callable[[str], Path], tmp_path: Path) -> None:
    words = ["relight", shot[0] / "asset", "--scene-lights", "-o", tmp_path / "shot.exr", "--reference", scene("designed"), "--samples", 64]
    said = done(*words).stderr
    told = said.split("relative rmse ")[1]
    made = read_image(tmp_path / "shot_cycles.exr")
    relit = read_image(tmp_path / "shot.exr")[:, :, :3]
    assert float(told.split("%")[0]) / 100 < 0.12 and "psnr" in told and made.shape == relit.shape
    assert "two different scenes" not in said
    assert "--reference without" in refused([*words, "--no-ambient"], 2)
