"""Bakes of named lights, clouds and patches: what the captures hold, stopped and resumed, by shards and several workers."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from faults import contents, workers_of
from light_set_commands import NAMES, done, of_a_process, refused, scenes_in
from test_resume import wait_for_lights

from srbf.bake import light_sets
from srbf.bake.light_sets import LIGHT_SET_FILE, PATCHES_FILE
from srbf.capture import Capture
from srbf.io.image import read_image

pytestmark = pytest.mark.blender

ATLAS = ["--receiver", "lightmap:Floor", "--receiver", "lightmap:Walls", "--size", "16"]
COUNTS = ["--samples", "8", "--validation", "1", "--holdout", "2", "--holdout-samples", "8", "--seed", "77"]
SETS = {
    "named": ["--light-set", "named"],
    "cloud": ["--light-set", "cloud", "--lights", "6", "--transport", "indirect"],
    "patches": ["--light-set", "patches", "--patches", "8", "--transport", "indirect"],
}
OFF = 0.1  # m that held-out lights keep off surfaces


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    return scenes_in(tmp_path_factory)


@pytest.fixture(scope="module")
def whole(scene, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """An undisturbed bake of a set, made when first asked for."""
    folder = tmp_path_factory.mktemp("whole")

    def bake(kind: str) -> Path:
        if not (folder / kind).exists():
            done("bake", scene("room"), "-o", folder / kind, *ATLAS, *COUNTS, *SETS[kind])
        return folder / kind

    return bake


def seeded(folder: Path, known: Path) -> Path:
    """The folder of a bake to come, with what is known of its scene: the query takes longer than the bake."""
    folder.mkdir()
    shutil.copyfile(known / LIGHT_SET_FILE, folder / LIGHT_SET_FILE)
    return folder


@pytest.mark.parametrize("kind", SETS)
def test_a_capture_holds_the_lights_of_its_set(whole, kind: str) -> None:
    capture = Capture.open(whole(kind))
    train = [light for light in capture.manifest["lights"] if light["role"] == "train"]
    tested = [light for light in capture.manifest["lights"] if light["role"] != "train"]
    assert {light["kind"] for light in train} == {{"named": "named", "cloud": "point", "patches": "patch"}[kind]}
    assert [light["kind"] for light in tested] == ([] if kind == "named" else ["point"] * 3)
    assert {light["samples"] for light in capture.manifest["lights"]} == {8}
    assert all("direct" not in light for light in train) and all("direct" in light for light in tested)
    covered = capture.coverage() >= 0.5
    for index in range(len(capture.lights)):
        image = capture.image(index)
        assert image.shape == (16, 16, 3) and np.isfinite(image).all() and image[covered].mean() > 1e-3
    if kind == "named":
        assert [light["name"] for light in train] == NAMES and [light["objects"] for light in train] == [[name] for name in NAMES]
        assert not {"patches", "free_places", "ambient"} & set(capture.manifest)
        return
    assert len(train) == (6 if kind == "cloud" else 8)
    assert [light["patch"] for light in train] == list(range(8)) if kind == "patches" else all("position" in light for light in train)
    free, low, high = np.array(capture.manifest["free_places"]), np.zeros(3), np.array([3, 2, 2])
    held = np.array([light["position"] for light in tested])
    assert free.shape == (light_sets.PLACES, 3)
    for places, off in ((free, 0.06), (held, OFF)):
        assert (places > low + off - 1e-6).all() and (places < high - off + 1e-6).all()
        assert not ((places > [2, 1.2, 0]) & (places < [2.5, 1.7, 0.6])).all(axis=1).any()  # in the crate
    cells = read_image(capture.folder / PATCHES_FILE)
    described = capture.manifest["patches"]
    assert described["file"] == PATCHES_FILE and cells.shape[0] == 2 and cells.shape[2] == 4
    assert set(np.unique(cells[1, :, 3])) == set(range(described["count"]))
    assert cells[0, :, 3].sum() == pytest.approx(32 + 1.2 - 0.25, rel=0.03)  # m2 of room and crate, without what the crate stands on


@pytest.mark.parametrize(
    ("receiver", "kind", "flags"),
    [
        ("view", "cloud", ["--transport", "combined"]),
        ("view", "patches", []),
        ("vertices:Crate", "patches", []),
        ("vertices:Crate", "cloud", []),
        ("view", "named", ["--transport", "indirect"]),
        ("vertices:Crate", "named", []),
    ],
)
def test_other_receivers_hold_them_too(scene, whole, tmp_path: Path, receiver: str, kind: str, flags: list[str]) -> None:
    folder = tmp_path / "capture" if kind == "named" else seeded(tmp_path / "capture", whole(kind))
    size = [] if "vertices" in receiver else ["--size", "12x8"]
    done("bake", scene("room"), "-o", folder, "--receiver", receiver, *size, *COUNTS, *SETS[kind], *flags)
    capture = Capture.open(folder)
    assert (capture.width, capture.height) == ((8, 1) if "vertices" in receiver else (12, 8))
    places = [{key: light.get(key) for key in ("kind", "name", "position", "patch")} for light in capture.manifest["lights"]]
    assert places == [{key: light.get(key) for key in places[0]} for light in Capture.open(whole(kind)).manifest["lights"]]
    images = np.stack([capture.image(index) for index in range(len(capture.lights))])
    assert np.isfinite(images).all() and (images.mean(axis=(1, 2, 3)) > 1e-4).all()


@pytest.mark.skipif(sys.platform != "linux", reason="looks for orphans in /proc")
@pytest.mark.parametrize("kind", ["cloud", "patches"])
def test_a_killed_bake_goes_on_to_the_same_bits(scene, whole, tmp_path: Path, kind: str) -> None:
    folder = seeded(tmp_path / "capture", whole(kind))
    command = ["bake", scene("room"), "-o", folder, *ATLAS, *COUNTS, *SETS[kind]]
    process = subprocess.Popen(of_a_process(*command), stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    wait_for_lights(folder, 4, process)
    os.kill(process.pid, signal.SIGKILL)
    process.communicate(timeout=60)
    deadline = time.monotonic() + 60
    while workers_of(folder):
        assert time.monotonic() < deadline, "the worker outlived its host"
        time.sleep(0.05)
    assert (folder / "bake.json").exists()
    again = done(*command)
    assert re.search(r"resuming: \d+ of \d+ lights are done", again.stderr) and "in the box" not in again.stderr  # no query
    assert contents(folder) == contents(whole(kind))


@pytest.mark.parametrize("kind", ["cloud", "patches"])
def test_a_finished_bake_starts_no_blender(scene, whole, kind: str) -> None:
    nowhere = ["--blender", "/nowhere/blender"]
    again = done("bake", scene("room"), "-o", whole(kind), *ATLAS, *COUNTS, *SETS[kind], *nowhere)
    assert "is complete already" in again.stderr and "in the box" not in again.stderr
    refused(["bake", scene("room"), "-o", whole(kind), *ATLAS, *COUNTS, *SETS[kind], *nowhere, "--seed", "78"])  # another set
    before = contents(whole(kind))
    dry = done("bake", scene("room"), "-o", whole(kind), *ATLAS, *COUNTS, *SETS[kind], "--dry-run")
    train = "6 train at 8 samples" if kind == "cloud" else "8 train at 8 samples"
    assert train in dry.stdout and "1 validation and 2 holdout at 8" in dry.stdout and contents(whole(kind)) == before


def test_shards_and_what_was_lost_give_the_same_bits(scene, whole, tmp_path: Path) -> None:
    """What is known of the scene is lost between the shards: it is found again, and the same."""
    folder = seeded(tmp_path / "capture", whole("patches"))
    command = ["bake", scene("room"), "-o", folder, *ATLAS, *COUNTS, *SETS["patches"]]
    assert "prepared" in done(*command, "--shard", "prepare").stderr
    assert "in the box" not in done(*command, "--shard", "1/2").stderr
    known = (folder / LIGHT_SET_FILE).read_bytes()
    (folder / LIGHT_SET_FILE).write_bytes(known[: len(known) // 2])
    (folder / PATCHES_FILE).unlink()
    assert "in the box" in done(*command, "--shard", "2/2").stderr
    assert "in the box" not in done(*command).stderr
    assert contents(folder) == contents(whole("patches"))


def test_workers_restart_and_force_give_the_same_bits(scene, whole, tmp_path: Path) -> None:
    folder = seeded(tmp_path / "capture", whole("cloud"))
    command = ["bake", scene("room"), "-o", folder, *ATLAS, *COUNTS, *SETS["cloud"]]
    done(*command, "--shard", "prepare")
    other = [*command, "--light-set", "named"]
    line = refused(other)
    assert "an unfinished capture" in line and "found another light set" in line and "--restart" in line
    assert (folder / LIGHT_SET_FILE).read_bytes() == (whole("cloud") / LIGHT_SET_FILE).read_bytes()
    done(*other, "--restart")
    assert len(Capture.open(folder).indices("train")) == 4 and not (folder / LIGHT_SET_FILE).exists()
    shutil.copyfile(whole("cloud") / LIGHT_SET_FILE, folder / LIGHT_SET_FILE)
    line = refused(command)
    assert "a finished capture" in line and "found another light set" in line and "--force" in line
    done(*command, "--force", "--workers", "2")
    assert contents(folder) == contents(whole("cloud"))


def test_a_light_that_is_deleted_after_the_bake(scene, tmp_path: Path) -> None:
    blend, folder = tmp_path / "room.blend", tmp_path / "capture"
    shutil.copyfile(scene("room"), blend)
    command = ["bake", blend, "-o", folder, "--receiver", "lightmap:Floor", "--size", "8", "--samples", "1", *SETS["named"]]
    done(*command)
    before = contents(folder)
    shutil.copyfile(scene("removed"), blend)
    line = refused(command)
    assert "found another scene" in line and "light set" in line and "--force" in line
    assert contents(folder) == before
    done(*command, "--force")
    assert [light["name"] for light in Capture.open(folder).manifest["lights"]] == [NAMES[0], *NAMES[2:]]
