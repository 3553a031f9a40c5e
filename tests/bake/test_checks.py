"""What is noticed at the start of a bake: black and unanswering lights, a disk too small."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from srbf.bake.checks import FIRST_LIGHTS, FirstLights, bytes_needed, check_disk
from srbf.bake.run import Bake, Reporter
from srbf.bake.settings import BakeSettings, Receiver
from srbf.errors import BakeError
from srbf.io.files import WriteError

BLACK = np.zeros((4, 5, 3), np.float32)
GRAY = np.full((4, 5, 3), 0.5, np.float32)


def looking(lights: int) -> tuple[FirstLights, list[str]]:
    said: list[str] = []
    return FirstLights(lights, "lightmap 'Plane'", said.append), said


def test_black_lights_are_said_at_once_and_end_the_bake_soon() -> None:
    first, said = looking(400)
    for i in range(FIRST_LIGHTS - 1):
        first.look(BLACK)
        assert len(said) == 1 and "lightmap 'Plane' is black" in said[0], i
    with pytest.raises(BakeError, match=f"{FIRST_LIGHTS} light images are black.*restart=True"):
        first.look(BLACK)


def test_one_lit_light_among_black_ones_is_enough() -> None:
    first, _ = looking(400)
    for i in range(FIRST_LIGHTS):
        first.look(GRAY if i == FIRST_LIGHTS - 1 else BLACK)
    assert first.lit and not first.looking
    first.look(BLACK)  # no longer looked at


def test_images_that_light_does_not_change_end_the_bake() -> None:
    first, _ = looking(400)
    for _ in range(FIRST_LIGHTS - 1):
        first.look(GRAY)
    with pytest.raises(BakeError, match="all hold 0.5.*does not respond to light"):
        first.look(GRAY)


def test_a_plane_is_constant_under_each_light_and_yet_responds() -> None:
    first, said = looking(400)
    for i in range(FIRST_LIGHTS):
        first.look(GRAY * np.float32(i + 1))
    assert not said


def test_a_few_black_lights_are_all_there_is() -> None:
    first, _ = looking(3)
    first.look(BLACK)
    first.look(BLACK)
    with pytest.raises(BakeError, match="all 3 light images"):
        first.look(BLACK)
    uniform, _ = looking(3)
    for _ in range(3):
        uniform.look(GRAY)  # too few to tell


@pytest.mark.parametrize(
    ("transport", "summed", "values"), [("combined", 0, 6 * 10), ("indirect", 0, 12 * 10), ("combined", 4, 6 * 10 + 24 * 4)]
)
def test_the_disk_that_a_capture_needs(transport: str, summed: int, values: int) -> None:
    """Ten lights of half floats, twice where direct light is apart; sums and their squares as floats; ten channels of geometry."""
    settings = BakeSettings(Receiver("lightmap", "Plane"), 8, 4, transport=transport)
    assert bytes_needed(settings, 10, summed) == 8 * 4 * (values + 40)


def test_a_small_disk_is_refused_before_anything_is_rendered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    check_disk(tmp_path / "not" / "there", 1)
    with monkeypatch.context() as patch:
        patch.setattr(shutil, "disk_usage", lambda path: type("Usage", (), {"free": 10**6}))
        with pytest.raises(WriteError, match="expected 1.00 GB free.*found 0.00 GB.*smaller `size`"):
            check_disk(tmp_path / "capture", 10**9)
        scene = tmp_path / "scene.blend"
        scene.write_bytes(b"never opened")
        with pytest.raises(WriteError, match="for the whole capture"):
            Bake(scene, tmp_path / "capture", BakeSettings(Receiver("view"), 1024, 1024)).run(Reporter())
    assert not (tmp_path / "capture").exists()


@pytest.mark.blender
def test_a_scene_that_no_light_reaches_ends_after_the_first_lights(blend: Callable[[str], Path], tmp_path: Path) -> None:
    """Lights from below a floor: 60 were asked for, 24 are rendered."""
    below = tmp_path / "below.lp"
    angles = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    below.write_text("60\n" + "".join(f"{i}.png {0.5 * np.cos(a)} {0.5 * np.sin(a)} -0.8\n" for i, a in enumerate(angles)))
    settings = BakeSettings(Receiver("lightmap", "Plane"), 8, 8, samples=1, validation=0, holdout=0, light_list=below)
    with pytest.raises(BakeError, match="are black"):
        Bake(blend("plane"), tmp_path / "capture", settings).run(Reporter())
    assert len(list((tmp_path / "capture").glob("lights/[0-9]*.exr"))) <= FIRST_LIGHTS + 2
