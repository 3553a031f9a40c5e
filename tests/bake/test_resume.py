"""Stopping and going on: kill -9 of host or worker, other settings, a second process; bit for bit the same in the end."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
from faults import contents, workers_of

from srbf.bake.run import Bake, Reporter
from srbf.bake.settings import BakeSettings, Receiver
from srbf.capture import Capture
from srbf.errors import BakeError, OutputExistsError
from srbf.io.image import write_image

pytestmark = pytest.mark.blender

SETTINGS = ["--size", "24", "--lights", "60", "--samples", "40", "--validation", "1", "--holdout", "1", "--holdout-samples", "8"]
SETTINGS += ["--sun-angle", "auto"]  # a number that is computed again by every run


def command(scene: Path, folder: Path) -> list[str]:
    return [sys.executable, "-m", "srbf", "bake", str(scene), "-o", str(folder), "--receiver", "lightmap:Plane", *SETTINGS]


def wait_for_lights(folder: Path, count: int, process: subprocess.Popen) -> None:
    deadline = time.monotonic() + 60
    while len(list(folder.glob("lights/[0-9]*.exr"))) < count:
        assert process.poll() is None, "the bake ended before it could be killed"
        assert time.monotonic() < deadline
        time.sleep(0.002)


@pytest.fixture(scope="module")
def uninterrupted(blend, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    folder = tmp_path_factory.mktemp("whole") / "capture"
    subprocess.run(command(blend("emissive"), folder), check=True, capture_output=True)
    return contents(folder)


@pytest.mark.skipif(sys.platform != "linux", reason="looks for orphans in /proc")
@pytest.mark.parametrize("victim", ["host", "interrupt"])
@pytest.mark.parametrize("after", [1, 17])
def test_killed_bakes_go_on_to_the_same_bits(blend, tmp_path: Path, uninterrupted: dict[str, bytes], victim: str, after: int) -> None:
    folder = tmp_path / "capture"
    process = subprocess.Popen(command(blend("emissive"), folder), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    wait_for_lights(folder, after, process)
    os.kill(process.pid, signal.SIGINT if victim == "interrupt" else signal.SIGKILL)
    out, err = process.communicate(timeout=60)
    assert process.returncode != 0 and out == ""
    if victim == "interrupt":
        assert process.returncode == 1
        assert len(err.strip().splitlines()[-1:]) == 1 and "Traceback" not in err
        assert "resumes" in err
    deadline = time.monotonic() + 20
    while workers_of(folder):
        assert time.monotonic() < deadline, "the worker outlived its host"
        time.sleep(0.05)
    assert (folder / "bake.json").exists()
    if victim == "interrupt":  # what is done is a valid capture
        capture = Capture.open(folder)
        assert len(capture.lights) >= after
        capture.image(0)
    (folder / "lights" / ".0003.1234.partial.exr").write_bytes(b"half written")
    done = len(list(folder.glob("lights/[0-9]*.exr")))
    assert after <= done < 62
    again = subprocess.run(command(blend("emissive"), folder), capture_output=True, text=True, check=True)
    said = re.search(r"(\d+) of 62 lights are done", again.stderr)
    counted = int(said[1]) if said else 0
    assert done - 1 <= counted <= done  # an image may be there before its light counts as done
    assert contents(folder) == uninterrupted


def test_a_dead_worker_is_replaced(blend, tmp_path: Path, uninterrupted: dict[str, bytes]) -> None:
    folder = tmp_path / "capture"
    process = subprocess.Popen(command(blend("emissive"), folder), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    wait_for_lights(folder, 5, process)
    (worker,) = workers_of(folder)
    os.kill(worker, signal.SIGKILL)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 0 and "tried again" in err and "signal 9" in err
    assert contents(folder) == uninterrupted


@pytest.mark.parametrize("flags", [["--workers", "3"], ["--lights-per-worker", "25"]])
def test_any_crew_gives_the_same_bits(blend, tmp_path: Path, uninterrupted: dict[str, bytes], flags: list[str]) -> None:
    folder = tmp_path / "capture"
    subprocess.run([*command(blend("emissive"), folder), *flags], check=True, capture_output=True)
    assert contents(folder) == uninterrupted


def job(blend, folder: Path, **changes: object) -> Bake:
    settings = {"width": 8, "height": 8, "lights": 4, "samples": 1, "validation": 0, "holdout": 0, **changes}
    return Bake(blend("occluder"), folder, BakeSettings(Receiver("lightmap", "Plane"), **settings))


def test_lights_of_some_roles_first_give_the_bits_of_one_bake(blend, tmp_path: Path) -> None:
    """Train lights alone are a capture that can be fitted; then the others are rendered, and those not again."""
    whole, folder = tmp_path / "whole", tmp_path / "capture"
    tested = {"samples": 2, "holdout": 2, "holdout_samples": 4}
    job(blend, whole, **tested).run(Reporter())
    told: list[tuple[float, float, str]] = []
    first = replace(job(blend, folder, **tested), roles=("train",))
    assert first.run(Reporter(lambda *progress: told.append(progress)))
    assert {light.role for light in Capture.open(folder).lights} == {"train"} and len(Capture.open(folder).lights) == 4
    assert told[-1] == (8, 8, "pass 1: light 4 of 4")
    rendered = [(path, path.stat().st_mtime_ns) for path in sorted(folder.glob("lights/*.exr"))]
    assert job(blend, folder, **tested).run(Reporter())
    assert contents(folder) == contents(whole) and not job(blend, folder, **tested).run(Reporter())
    assert rendered == [(path, path.stat().st_mtime_ns) for path, _ in rendered]


def test_samples_added_later_give_the_bits_of_one_bake(blend, tmp_path: Path) -> None:
    """2 samples, then 8: as 8 from the start, manifest and all; without the sums that is refused."""
    whole, folder = tmp_path / "whole", tmp_path / "capture"
    eight = {"samples": 8, "holdout": 2, "holdout_samples": 16, "validation": 1}
    job(blend, whole, **eight).run(Reporter())
    kept = replace(job(blend, folder, **{**eight, "samples": 2}), keep_accumulation=True)
    assert kept.run(Reporter())
    assert {light["samples"] for light in Capture.open(folder).manifest["lights"]} == {2, 16}
    assert (folder / "accumulation").is_dir() and not (whole / "accumulation").exists()
    assert job(blend, folder, **eight).run(Reporter())
    assert contents(folder) == contents(whole)
    with pytest.raises(OutputExistsError, match="accumulation.*`keep_accumulation=True`"):
        job(blend, folder, **{**eight, "samples": 16}).run(Reporter())
    assert contents(folder) == contents(whole)


def test_a_bake_stops_when_its_time_is_up_and_goes_on(blend, tmp_path: Path) -> None:
    folder = tmp_path / "capture"
    said: list[str] = []
    timed = replace(job(blend, folder, lights=6, samples=1 << 16, holdout=1), time_limit=4.0)
    started = time.monotonic()
    assert timed.run(Reporter(say=said.append))
    assert 4 <= time.monotonic() - started < 20
    assert "the time is up at" in said[-1]
    first = Capture.open(folder)
    assert len(first.lights) == 7
    assert replace(timed, time_limit=3.0).run(Reporter())
    assert sum(light["samples"] for light in Capture.open(folder).manifest["lights"]) > sum(
        light["samples"] for light in first.manifest["lights"]
    )


def test_auto_decides_alike_however_often_it_is_stopped(blend, tmp_path: Path) -> None:
    whole, folder = tmp_path / "whole", tmp_path / "capture"
    auto = {"samples": "auto", "lights": 24, "validation": 3, "holdout": 1, "holdout_samples": 8}
    job(blend, whole, **auto).run(Reporter())
    curve = Capture.open(whole).manifest["source"]["validation_curve"]
    assert [entry["samples"] for entry in curve] == [2**i for i in range(len(curve))] and len(curve) >= 2
    assert Capture.open(whole).manifest["source"]["settings"]["samples"] == curve[-1]["samples"]
    for seconds in (1.5, 1.9, 2.4):
        replace(job(blend, folder, **auto), time_limit=seconds).run(Reporter())
    assert job(blend, folder, **auto).run(Reporter()) or (folder / "capture.json").exists()
    assert contents(folder) == contents(whole)
    assert not job(blend, folder, **auto).run(Reporter())


def test_damaged_files_are_rendered_again(blend, tmp_path: Path) -> None:
    whole, folder = tmp_path / "whole", tmp_path / "capture"
    several = {"samples": 8, "holdout": 1, "holdout_samples": 8}
    replace(job(blend, whole, **several), keep_accumulation=True).run(Reporter())
    shutil.copytree(whole, folder)
    state = Capture.open(folder).manifest["source"]
    (folder / "bake.json").write_text(json.dumps({key: state[key] for key in ("scene", "scene_sha256", "settings", "blender")}))
    (folder / "lights/0001.exr").write_bytes((whole / "lights/0001.exr").read_bytes()[:200])
    (folder / "accumulation/0002.npz").write_bytes((whole / "accumulation/0002.npz").read_bytes()[:-40])
    (folder / "lights/0003.exr").unlink()
    (folder / "accumulation/0003.npz").unlink()
    (folder / "normal.exr").write_bytes(b"")
    assert replace(job(blend, folder, **several), keep_accumulation=True).run(Reporter())
    assert contents(folder) == contents(whole)


def test_other_settings_are_refused_and_named(blend, tmp_path: Path) -> None:
    folder = tmp_path / "capture"
    assert job(blend, folder).run(Reporter())
    before = contents(folder)
    assert not job(blend, folder).run(Reporter())  # complete already
    with pytest.raises(OutputExistsError, match="samples.*`force=True`"):
        job(blend, folder, samples=2).run(Reporter())
    assert contents(folder) == before
    (folder / "capture.json").rename(tmp_path / "manifest")
    (folder / "bake.json").write_text((tmp_path / "manifest").read_text().replace('"srbf-capture"', '"x"'))
    with pytest.raises(OutputExistsError, match="scene"):
        job(blend, folder, samples=2).run(Reporter())
    assert job(blend, folder, samples=2).run(Reporter(), restart=True)
    assert job(blend, folder).run(Reporter(), force=True)
    assert contents(folder) == before


def test_a_corrected_receiver_needs_no_flag(blend, tmp_path: Path) -> None:
    folder = tmp_path / "capture"
    wrong = Bake(blend("occluder"), folder, BakeSettings(Receiver("lightmap", "Plan"), 8, 8))
    with pytest.raises(BakeError, match="'Plan'"):
        wrong.run(Reporter())
    assert not folder.exists()
    assert job(blend, folder).run(Reporter())


def test_killed_while_emptying_no_old_light_survives(blend, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """--force dies after the first deletion: the next run, of yet other settings, must not take the old lights for its own."""
    folder = tmp_path / "capture"
    assert job(blend, folder, samples=1).run(Reporter())

    def die(path: Path) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("srbf.bake.folder.shutil.rmtree", lambda path, ignore_errors=False: None if ignore_errors else die(path))
        with pytest.raises(KeyboardInterrupt):
            job(blend, folder, samples=2).run(Reporter(), force=True)
    assert list(folder.glob("lights/*.exr"))
    assert job(blend, folder, samples=4).run(Reporter())
    fresh = tmp_path / "fresh"
    job(blend, fresh, samples=4).run(Reporter())
    assert contents(folder) == contents(fresh)


def test_a_second_process_is_refused(blend, tmp_path: Path) -> None:
    import filelock

    folder = tmp_path / "capture"
    folder.mkdir()
    with filelock.FileLock(folder / ".lock"):
        for restart in (False, True):
            with pytest.raises(BakeError, match="another process"):
                job(blend, folder).run(Reporter(), restart=restart)
    assert job(blend, folder).run(Reporter())


def test_a_folder_of_other_things_is_left_alone(blend, tmp_path: Path) -> None:
    write_image(tmp_path / "holiday.png", __import__("numpy").zeros((2, 2, 3), "uint8"), "uint8")
    with pytest.raises(OutputExistsError, match="other files"):
        job(blend, tmp_path).run(Reporter(), force=True)
    assert [p.name for p in tmp_path.iterdir()] == ["holiday.png"]
