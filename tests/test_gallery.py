"""The gallery at a tiny size: killed during its bake, resumed, run again, and run again after the loss of one picture."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.evaluation.errors_by_role import evaluate
from srbf.io import files

pytestmark = pytest.mark.blender
image = pytest.importorskip("PIL.Image")
pytest.importorskip("matplotlib")

ROOT = Path(__file__).parent.parent
SCENE, FRAMES = "caustics", 6
PATIENCE = 120.0  # s until a bake must have begun, on a busy machine


@dataclass(frozen=True)
class Gallery:
    """Where one was made."""

    out: Path
    docs: Path

    @property
    def command(self) -> list[str]:
        return [sys.executable, "-m", "scripts.gallery", "--small", "--only", SCENE, "-o", str(self.out), "--docs", str(self.docs)]

    def make(self) -> str:
        return subprocess.run(self.command, cwd=ROOT, check=True, capture_output=True, text=True).stdout

    def times(self) -> dict[str, dict]:
        path = self.out / "times.json"
        return files.read_json(path)["steps"] if path.is_file() else {}

    def written(self) -> dict[Path, int]:
        """When each of its files was."""
        found = [p for folder in (self.out, self.docs.parent) for p in folder.rglob("*") if p.is_file() and p.suffix != ".lock"]
        return {path: path.stat().st_mtime_ns for path in found}


@pytest.fixture(scope="module")
def gallery(tmp_path_factory: pytest.TempPathFactory) -> Gallery:
    """Killed as its bake has begun, and made by the same command again."""
    folder = tmp_path_factory.mktemp("gallery")
    made = Gallery(folder / "out", folder / "docs" / "gallery")
    begun = subprocess.Popen(made.command, cwd=ROOT, stdout=subprocess.DEVNULL, start_new_session=True)
    until = time.monotonic() + PATIENCE
    lights = made.out / SCENE / "capture" / "lights"
    while not any(lights.glob("*.exr")):
        assert time.monotonic() < until and begun.poll() is None, "the bake does not begin"
        time.sleep(0.02)
    os.killpg(begun.pid, signal.SIGKILL)
    begun.wait()
    assert not made.times()[f"{SCENE}/bake"]["done"]
    made.make()
    return made


def test_it_goes_on_after_a_kill(gallery: Gallery) -> None:
    times = gallery.times()
    assert all(step["done"] for step in times.values())
    assert times[f"{SCENE}/bake"]["interrupted"] == 1 and times[f"{SCENE}/build"]["interrupted"] == 0


def test_pictures_are_there_and_the_clip_moves(gallery: Gallery) -> None:
    for name in (f"{SCENE}-strip", "error-by-bytes"):
        with image.open(gallery.docs / f"{name}.webp") as shown:
            assert min(shown.size) > 100 and np.asarray(shown.convert("L")).std() > 5
    with image.open(gallery.docs / f"{SCENE}-clip.webp") as clip:
        assert clip.n_frames == FRAMES and clip.info["loop"] == 0
        frames = []
        for number in range(FRAMES):
            clip.seek(number)
            frames.append(np.asarray(clip.convert("RGB"), np.float32))
    for before, after in zip(frames, [*frames[1:], frames[0]], strict=True):
        assert np.abs(before - after).mean() > 0.5


def test_figures_of_the_page_are_those_of_an_evaluation(gallery: Gallery) -> None:
    page = gallery.docs.with_suffix(".md").read_text(encoding="utf-8")
    capture = Capture.open(gallery.out / SCENE / "capture")
    for folder, name in (("asset-25-maps", "25 maps of combined light"), ("asset", "best of 16 bytes")):
        error = evaluate(Asset.open(gallery.out / SCENE / folder), capture)["holdout"]
        (row,) = re.findall(rf"^\| {name}.*$", page, re.MULTILINE)
        assert row.endswith(f"| {error['psnr']:.2f} dB | {error['relative_rmse']:.3f} |")
    for link in re.findall(r"!\[[^\]]*\]\(([^)]+)\)", page):
        assert (gallery.docs.parent / link).is_file()


def test_a_second_run_writes_nothing(gallery: Gallery) -> None:
    before = gallery.written()
    assert ", 0 steps" in gallery.make()
    assert gallery.written() == before


def test_a_lost_picture_alone_is_made_anew(gallery: Gallery) -> None:
    before = gallery.written()
    lost = gallery.docs / f"{SCENE}-clip.webp"
    content = lost.read_bytes()
    lost.unlink()
    assert ", 1 steps" in gallery.make()
    after = gallery.written()
    assert lost.read_bytes() == content
    may_change = {lost, gallery.out / "times.json", gallery.docs.with_suffix(".md")}  # the latter two say how long it took
    assert {path for path in after if after[path] != before.get(path)} <= may_change and after.keys() == before.keys()


def test_an_output_that_is_a_file_is_said_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("")
    command = [sys.executable, "-m", "scripts.gallery", "-o", str(tmp_path / "taken")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (1, "")
    assert done.stdout.startswith("gallery: cannot make folder") and len(done.stdout.splitlines()) == 1
