"""The gallery's scenes, built and baked tiny: that each shows what it was made to show."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import Baked

from scripts.gallery.scenes import SCENES
from srbf.bake.settings import BakeSettings, Receiver
from srbf.capture import Capture
from srbf.demo import build_scene
from srbf.visibility.rays import RayTracer
from srbf.visibility.receivers import Receivers

pytestmark = pytest.mark.blender

LEFT, RIGHT, ABOVE = (-0.8, -0.2, 0.56), (0.8, -0.2, 0.56), (0.05, -0.1, 0.99)
WIDTH, HEIGHT = 48, 36
SEALED = 1 - 1e-5  # coverage where no ray leaves the scene, except for rounding


@pytest.fixture
def bake(tmp_path: Path) -> Callable[..., Capture]:
    """Build a scene and bake it tiny under lights from `directions`."""

    def run(
        name: str, receiver: str, directions: Sequence[tuple[float, float, float]], width: int = WIDTH, height: int = HEIGHT
    ) -> Capture:
        scene = tmp_path / f"{name}.blend"
        if not scene.exists():
            build_scene(name, scene)
        lights = tmp_path / f"{name}.lp"
        rows = [f"{i} {x} {y} {z}" for i, (x, y, z) in enumerate(directions)]
        lights.write_text("\n".join([str(len(rows)), *rows]) + "\n")
        kind = Receiver.parse(receiver)
        quantity = "radiance" if kind.kind == "view" else "irradiance"
        small = {"width": width, "height": height, "samples": 1, "validation": 0, "holdout": 0, "quantity": quantity}
        return Baked(scene, tmp_path / f"{name} {kind.kind}", BakeSettings(kind, light_list=lights, **small)).capture

    return run


def floor_of(capture: Capture) -> np.ndarray:
    """Where the picture shows what is level and at z = 0."""
    return (capture.geometry("normal")[..., 2] > 0.99) & (np.abs(capture.geometry("position")[..., 2]) < 1e-3)


def test_walls_color_the_floor_before_them(bake) -> None:
    capture = bake("colored_room", "view", [LEFT, RIGHT])
    assert capture.coverage().min() > SEALED
    x, normal = capture.geometry("position")[..., 0], capture.geometry("normal")
    from_left, from_right = capture.image(0), capture.image(1)
    red_wall, green_wall = (normal[..., 0] > 0.99) & (x < -1.2), (normal[..., 0] < -0.99) & (x > 1.2)
    assert red_wall.sum() > 30 and green_wall.sum() > 30
    for wall, lit, unlit, channel in ((red_wall, from_right, from_left, 0), (green_wall, from_left, from_right, 1)):
        color = lit[wall].mean(0)
        assert color[channel] > 4 * np.delete(color, channel).max()
        assert color[channel] > 4 * unlit[wall].mean(0)[channel]  # which faces away from the sun, and sees only bounces
    floor, both = floor_of(capture), from_left + from_right
    near_red, near_green = both[floor & (x < -0.85)].mean(0), both[floor & (x > 0.85)].mean(0)
    assert near_red[0] / near_red[1] > 1.15 * near_green[0] / near_green[1]


def test_leaves_and_laths_shade_the_floor_differently_under_every_sun(bake) -> None:
    directions = [LEFT, RIGHT, ABOVE, (-0.5, 0.55, 0.65), (0.6, 0.6, 0.5), (0.5, -0.6, 0.6)]
    capture = bake("lattice", "view", directions)
    assert capture.coverage().min() > SEALED
    floor, position = floor_of(capture), capture.geometry("position")
    assert floor.mean() > 0.25
    white = np.stack([capture.image(i)[..., 1] for i in range(len(directions))])[:, floor] / capture.geometry("albedo")[floor][:, 1]
    lit = white > 0.6 * capture.directions()[:, 2:] / np.pi  # more than bounces bring
    switching = lit.any(0) & ~lit.all(0)
    assert switching.mean() > 0.35
    x, y = position[floor][:, 0], position[floor][:, 1]
    below = (np.abs(x + 0.65) < 1.3) & (np.abs(y - 0.85) < 1.2)
    in_the_open = (x < -0.5) & (y < -1.2)
    assert 0.25 < lit[2][below].mean() < 0.85 < lit[2][in_the_open].mean()  # a sun overhead, through slats and leaves


def test_the_lattice_floor_is_a_lightmap_of_its_own(bake) -> None:
    capture = bake("lattice", "lightmap:Floor", [ABOVE], width=24, height=24)
    assert capture.manifest["receiver"] == {"kind": "lightmap", "object": "Floor", "uv_layer": "lightmap"}
    assert capture.coverage().min() > SEALED
    middles = ((np.arange(24) + 0.5) / 24 - 0.5) * 5.0
    position = capture.geometry("position")
    np.testing.assert_allclose(position[..., 0], np.broadcast_to(middles, (24, 24)), atol=1e-3)  # u along +x
    np.testing.assert_allclose(position[..., 1], np.broadcast_to(-middles[:, None], (24, 24)), atol=1e-3)  # v along +y, row 0 on top
    image = capture.image(0)[..., 1]
    assert (image < 0.3).sum() > 30 and (image > 0.9).sum() > 200


def test_a_coin_turns_its_shading_with_the_light(bake) -> None:
    raking = [(-0.87, 0, 0.5), (0.87, 0, 0.5)]
    capture = bake("coin", "view", [*raking, ABOVE], width=48, height=48)
    assert capture.coverage().min() > SEALED
    position, slope = capture.geometry("position"), capture.geometry("normal")[..., 0]
    x, y, z = np.moveaxis(position, -1, 0)
    coin, felt = z > -0.06, z < -0.12
    assert coin.mean() == pytest.approx(np.pi / 2.24**2, rel=0.03)  # a disc of radius 1 m in a picture 2.24 m wide
    from_left, from_right, above = (capture.image(i).mean(-1) for i in range(3))
    to_left, to_right = coin & (slope < -0.25), coin & (slope > 0.25)
    assert min(to_left.sum(), to_right.sum()) > 60
    assert from_left[to_left].mean() > 2 * from_right[to_left].mean()
    assert from_right[to_right].mean() > 2 * from_left[to_right].mean()
    assert above[coin].mean() > 5 * above[felt].mean()  # bronze on dark felt
    beside = felt & (np.abs(y) < 0.3) & (np.abs(x) < 1.1)
    left, right = beside & (x < 0), beside & (x > 0)
    assert from_left[left].mean() > 4 * from_left[right].mean() and from_right[right].mean() > 4 * from_right[left].mean()  # its shadow


def test_a_still_life_of_uneven_scales_shades_itself(tmp_path: Path) -> None:
    """Seven receivers in one atlas, as it is laid out; rays give Cycles' own direct light back on every one of them."""
    (scene,) = [scene for scene in SCENES if scene.name == "still_life"]
    build_scene(scene.name, tmp_path / "still_life.blend")
    settings = replace(scene.bake_settings(), width=64, height=64, lights=4, samples=1, holdout=2, holdout_samples=64, validation=0)
    baked = Baked(tmp_path / "still_life.blend", tmp_path / "capture", settings)
    capture = baked.capture
    assert not any("packed" in line for line in baked.said)
    described = capture.manifest["receivers"]
    assert [one["object"] for one in described] == [word.partition(":")[2] for word in scene.receivers]
    covered = capture.coverage() > 0
    assert covered.mean() > 0.75
    tracer = RayTracer(Receivers.of(capture))
    for index in capture.indices("holdout"):
        true = capture.combined().image(index) - capture.image(index)
        found = tracer.directional(capture.directions([index]))[0]
        error = np.abs(found - true)[covered].max(axis=1)
        assert 20 * np.log10(true.max() / np.sqrt((error**2).mean())) > 38
        assert np.median(error) < 2e-3 * true.max()
    warm = capture.image(capture.indices("holdout")[0])[covered]
    assert warm.max() > 0.05  # what they reflect onto each other
