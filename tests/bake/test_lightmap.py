"""Lightmap bakes by real Cycles: calibration, axes and rows, shadows at world points, environment maps, ambient, materials, UV layers."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from srbf.asset import Asset
from srbf.bake.run import Bake, Reporter
from srbf.bake.settings import BakeSettings, Receiver, plan_lights
from srbf.capture import Capture
from srbf.errors import BakeError
from srbf.io.image import write_image
from srbf.lights import DirectionalLight, EnvironmentLight
from srbf.methods import relight
from srbf.methods.relighting_map import RelightingMap

pytestmark = pytest.mark.blender

HALF = 2.0**-11  # relative rounding of a stored half float
TEXEL = 2 / 32  # m
TEXEL_CENTER = 0.01  # texels: the first sample of a bake stands this near to the center


@pytest.mark.parametrize(("quantity", "scale"), [("irradiance", 1.0), ("radiance", 1 / np.pi)])
def test_a_white_plane_responds_by_the_cosine(bake, quantity: str, scale: float) -> None:
    capture = bake("plane", "lightmap:Plane", quantity=quantity).capture
    assert capture.ambient() is None  # its light and world were off
    for index, light in enumerate(capture.lights):
        np.testing.assert_allclose(capture.image(index), max(0.0, light.direction[2]) * scale, rtol=HALF, atol=1e-6)
    assert capture.manifest["receiver"] == {"kind": "lightmap", "object": "Plane", "uv_layer": "UV"}


def test_texels_stand_at_their_world_points(bake) -> None:
    capture = bake("plane", "lightmap:Plane", width=16, height=8).capture
    position = capture.geometry("position")
    assert position is not None
    x = 10 - 1 + 2 * (np.arange(16) + 0.5) / 16  # u along +x
    y = 5 + 1 - 2 * (np.arange(8) + 0.5) / 8  # row 0 is the top, v = 1, +y
    np.testing.assert_allclose(position[..., 0], np.broadcast_to(x, (8, 16)), atol=TEXEL_CENTER * 2 / 16)
    np.testing.assert_allclose(position[..., 1], np.broadcast_to(y[:, None], (8, 16)), atol=TEXEL_CENTER * 2 / 8)
    np.testing.assert_allclose(capture.geometry("normal"), np.broadcast_to([0, 0, 1], (8, 16, 3)), atol=1e-3)
    np.testing.assert_allclose(capture.geometry("albedo"), 1, atol=1e-3)
    assert (capture.coverage() == 1).all()


def nearest_texel(position: np.ndarray, x: float, y: float) -> tuple[int, int]:
    row, column = np.unravel_index(np.linalg.norm(position[..., :2] - [x, y], axis=2).argmin(), position.shape[:2])
    return int(row), int(column)


@pytest.fixture(scope="module")
def occluder(blend, tmp_path_factory: pytest.TempPathFactory) -> Capture:
    settings = BakeSettings(Receiver.parse("lightmap:Plane"), 32, 32, lights=300, samples=2, validation=0, holdout=0, quantity="irradiance")
    folder = tmp_path_factory.mktemp("occluder") / "capture"
    Bake(blend("occluder"), folder, settings).run(Reporter())
    return Capture.open(folder)


@pytest.fixture(scope="module")
def shadowed(occluder: Capture) -> Asset:
    return RelightingMap(k=60).encode(occluder)


def test_shadows_fall_where_the_wall_casts_them(occluder: Capture, shadowed: Asset) -> None:
    """The wall on x = 0, y in [0, 1], 0.5 m high, casts 0.5 m to the side away from a 45-degree sun."""
    asset = shadowed
    position = asset.images["position"]
    cosine = np.sqrt(0.5)
    for sun, shaded, lit in [
        ((1, 0, 1), [(-0.15, 0.5), (-0.2, 0.7)], [(0.25, 0.5), (-0.25, -0.6), (-0.9, 0.5), (0.6, -0.5)]),
        ((-1, 0, 1), [(0.15, 0.5), (0.2, 0.7)], [(-0.25, 0.5), (0.25, -0.6), (0.9, 0.5), (-0.6, -0.5)]),
    ]:
        relit = relight(asset, [DirectionalLight(sun)])
        for x, y in shaded:
            assert relit[nearest_texel(position, x, y)].max() < 0.5 * cosine, (sun, x, y)
        for x, y in lit:
            # The 60 Gaussians of this fit leave 8 % on lit texels away from the shadow's edge.
            np.testing.assert_allclose(relit[nearest_texel(position, x, y)], cosine, atol=0.12)
    # In the capture itself the shadow is sharp: at every world point of every image, exactly.
    checked = 0
    for index in range(0, 300, 7):
        light, image = occluder.lights[index], occluder.image(index)[..., 0]
        lx, ly, lz = light.direction
        for x, y in [(-0.3, 0.5), (0.4, 0.3), (0.1, -0.5), (-0.1, 0.9)]:
            t = -x / lx if abs(lx) > 1e-6 else -1.0  # the ray meets the plane of the wall after t
            height, along = t * lz, y + t * ly
            if abs(height - 0.5) < 2 * TEXEL or min(abs(along), abs(along - 1)) < 2 * TEXEL:
                continue  # near the edge of the shadow
            blocked = t > 0 and height < 0.5 and 0 < along < 1
            got = image[nearest_texel(position, x, y)]
            assert got == pytest.approx(0 if blocked else lz, abs=2e-3), (light.direction, x, y)
            checked += 1
    assert checked > 100


def test_cycles_under_an_environment_equals_the_environment_relight(shadowed: Asset, blend, tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    environment = rng.random((16, 32, 3)).astype(np.float32)
    environment[3:5, 20:23] = [8, 6, 4]
    environment[8:] = 0  # below the horizon nothing was captured
    write_image(tmp_path / "environment.exr", environment, "float")
    scenes = Path(__file__).parents[2] / "data" / "scenes" / "closed_form_scenes.py"
    scene = blend("occluder")
    subprocess.run(
        [sys.executable, str(scenes), "hdri", str(scene), str(tmp_path / "environment.exr"), str(tmp_path / "e.npy")],
        check=True,
        capture_output=True,
    )
    reference = np.load(tmp_path / "e.npy")
    relit = relight(shadowed, [EnvironmentLight(environment)])
    # Environments average over the fit's ringing: 4 % of the mean, where single suns of this scene err by 15 %. Cycles filters bilinearly.
    assert np.sqrt(((relit - reference) ** 2).mean()) < 0.04 * reference.mean()
    # Mirrored or turned, the same environment is far from it: the axes are right.
    for wrong in (environment[:, ::-1], np.roll(environment, 16, axis=1), np.roll(environment, 8, axis=1)):
        other = relight(shadowed, [EnvironmentLight(np.ascontiguousarray(wrong))])
        assert np.sqrt(((other - reference) ** 2).mean()) > 2 * np.sqrt(((relit - reference) ** 2).mean())


def test_what_the_scene_emits_becomes_ambient(bake) -> None:
    capture = bake("emissive", "lightmap:Plane", samples=16, holdout_samples=256).capture
    ambient = capture.ambient()
    assert ambient is not None
    # A lambert emitter of radiance 5 and 0.16 m2, 1 m above: E = 5 * 0.16 at the point below it, less off axis.
    center = ambient[15:17, 15:17].mean(axis=(0, 1))
    np.testing.assert_allclose(center, np.array([1, 0.5, 0.25]) * 5 * 0.16 / 1.07, rtol=0.1)
    for index, light in enumerate(capture.lights):
        corner = capture.image(index)[0, 0]  # far from the glowing square: the sun alone
        np.testing.assert_allclose(corner, light.direction[2], rtol=HALF)  # and free of the glow's noise
    asset = RelightingMap(k=4).encode(capture)
    np.testing.assert_array_equal(relight(asset, []), asset.images["ambient"])


def test_kept_point_lights_are_ambient_and_only_there(bake) -> None:
    plain = bake("emissive", "lightmap:Plane", name="plain", samples=4, holdout_samples=16).capture
    kept = bake("emissive", "lightmap:Plane", name="kept", samples=4, holdout_samples=16, keep_scene_lights=True).capture
    assert kept.ambient().mean() > 1.5 * plain.ambient().mean()
    for index in range(len(plain.lights)):
        np.testing.assert_array_equal(kept.image(index), plain.image(index))


def test_metal_gets_white_lambert_irradiance_and_says_so(bake) -> None:
    baked = bake("metal", "lightmap:Plane")
    assert any("steel" in line and "Lambert" in line for line in baked.said)
    assert not any("paint" in line for line in baked.said)
    for index, light in enumerate(baked.capture.lights):
        np.testing.assert_allclose(baked.capture.image(index), light.direction[2], rtol=0.01)


def test_a_lightmap_layer_is_made_when_none_fits(bake) -> None:
    for obj in ("NoUV", "Tiled"):
        baked = bake("layers", f"lightmap:{obj}", name=obj)
        assert any("made a lightmap UV layer" in line for line in baked.said)
        assert (baked.capture.folder / "uv.json").is_file()
        covered = baked.capture.coverage() > 0
        assert covered.mean() > 0.2
        np.testing.assert_allclose(baked.capture.image(0)[covered], baked.capture.lights[0].direction[2], rtol=0.01)
    second = bake("layers", "lightmap:Second")
    assert second.capture.manifest["receiver"]["uv_layer"] == "fits" and any("'fits'" in line for line in second.said)


@pytest.mark.parametrize(
    ("receiver", "layer", "words"),
    [
        ("lightmap:Full", None, "8 layers"),
        ("lightmap:Full", "bad 3", "area"),
        ("lightmap:NoUV", "UV", "none"),
        ("lightmap:Nobody", None, "'Nobody'.*'Full'"),
        ("lightmap:Hidden", None, "renderable"),
        ("lightmap:Empty mesh", None, "faces"),
        ("view", None, "camera"),
        ("view:Cam", None, "'Cam'"),
    ],
)
def test_receivers_that_cannot_be(bake, tmp_path: Path, receiver: str, layer: str | None, words: str) -> None:
    with pytest.raises(BakeError, match=words) as caught:
        bake("layers", receiver, uv_layer=layer)
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "capture" / "capture.json").exists()


def test_modifiers_are_applied_and_shared_meshes_left_alone(bake) -> None:
    baked = bake("subdivided", "lightmap:Plane")
    np.testing.assert_allclose(baked.capture.image(0), baked.capture.lights[0].direction[2], rtol=HALF)


def test_what_modifiers_scatter_still_casts_shadows(bake) -> None:
    capture = bake("scattered", "lightmap:Plane", lights=20).capture
    index = int(capture.directions()[:, 2].argmax())
    middle = capture.image(index)[15:17, 15:17]
    assert middle.max() < 0.1 * capture.lights[index].direction[2]  # under the scattered plate
    assert capture.image(index)[0, 0, 0] > 0.9 * capture.lights[index].direction[2]


def test_a_view_layer_cannot_override_light_or_samples(bake) -> None:
    capture = bake("overriding", "lightmap:Plane").capture
    assert capture.ambient() is None


def test_a_made_layer_is_found_again(bake) -> None:
    again = bake("layers", "lightmap:NoUV", uv_layer="srbf lightmap").capture
    assert again.manifest["receiver"]["uv_layer"] == "srbf lightmap" and again.coverage().any()


def test_hostile_files_run_nothing_and_name_what_is_missing(bake, blend) -> None:
    scene = blend("hostile")
    marker = scene.with_suffix(".pwned")
    marker.unlink(missing_ok=True)
    before = scene.read_bytes()
    baked = bake("hostile", "lightmap:Plane")
    assert not marker.exists()
    assert scene.read_bytes() == before
    assert any("brick" in line and "missing texture" in line for line in baked.said)


def test_each_light_has_its_own_noise(bake) -> None:
    job = bake("occluder", "lightmap:Plane").job
    seeds = [light.seed for light in plan_lights(job.settings)]
    assert len(set(seeds)) == len(seeds)
