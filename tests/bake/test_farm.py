"""One bake by many machines: dask workers that die, shards in any order, a render farm's job; bit for bit what one process bakes."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from faults import contents
from made_captures import write_capture
from test_resume import wait_for_lights

from srbf.asset import Asset
from srbf.bake.accumulation import Accumulation
from srbf.bake.folder import hold, hold_shard
from srbf.bake.gather_set import GatherSet
from srbf.bake.images import CaptureImages
from srbf.bake.light_pass import add_pass
from srbf.bake.light_sets import CloudSet, NamedSet
from srbf.bake.openjd import LIGHT_LIST, arguments, template
from srbf.bake.point_lights import PointGrid
from srbf.bake.run import Bake, Reporter
from srbf.bake.schedule import render_order
from srbf.bake.settings import BakeSettings, Receiver, plan_lights
from srbf.bake.shard import Shard
from srbf.bake.worker_pool import Response, Task, WorkerPoolSettings
from srbf.capture import Capture
from srbf.compute.dask_client import Cluster, ClusterError, checked
from srbf.errors import BakeError, InputError
from srbf.evaluation.errors_by_role import evaluate
from srbf.fitting.options import encode
from srbf.methods import FitRun
from srbf.methods.eigen_map import EigenMap

pytest.importorskip("distributed")

FLAGS = ["--receiver", "lightmap:Plane", "--size", "24", "--lights", "20", "--samples", "8"]
FLAGS += ["--validation", "1", "--holdout", "1", "--holdout-samples", "8"]
FIT = ["-k", "6", "--spread", "mean", "--ridge", "0.1"]
HALF = 2.0**-10  # of the maps' range: two values that float32 rounds apart may be neighbors as half floats
LIGHTS = 22


def srbf(*words: object) -> list[str]:
    return [sys.executable, "-m", "srbf", *map(str, words)]


def run(*words: object) -> subprocess.CompletedProcess[str]:
    done = subprocess.run(srbf(*words), capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return done


@pytest.fixture(scope="module")
def plain(blend, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("plain") / "capture"
    run("bake", blend("emissive"), "-o", folder, *FLAGS)
    return folder


class LocalCluster:
    """A scheduler and three workers, each a process."""

    def __init__(self, folder: Path) -> None:
        self._file = folder / "scheduler.json"
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": folder}
        command = [sys.executable, "-m", "dask"]
        here = ["--host", "127.0.0.1", "--no-dashboard", "--scheduler-file", str(self._file)]
        self.scheduler = subprocess.Popen([*command, "scheduler", "--port", "0", *here], **quiet)
        deadline = time.monotonic() + 60
        while not self._file.exists() or not self._file.read_text().endswith("}"):
            assert self.scheduler.poll() is None and time.monotonic() < deadline
            time.sleep(0.05)
        self.address = json.loads(self._file.read_text())["address"]
        alone = ["--nthreads", "1", "--no-nanny", "--no-dashboard", "--local-directory", str(folder)]
        self.workers = [subprocess.Popen([*command, "worker", self.address, *alone], **quiet) for _ in range(3)]
        with Cluster(self.address) as cluster:
            while cluster.threads < 3:
                assert all(worker.poll() is None for worker in self.workers) and time.monotonic() < deadline + 60
                time.sleep(0.05)

    def close(self) -> None:
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()


@pytest.fixture(scope="module")
def machines(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LocalCluster]:
    cluster = LocalCluster(tmp_path_factory.mktemp("cluster"))
    yield cluster
    cluster.close()


@pytest.mark.blender
def test_dask_workers_bake_the_same_bits_though_one_is_killed(blend, machines: LocalCluster, plain: Path, tmp_path: Path) -> None:
    folder = tmp_path / "capture"
    command = srbf("bake", blend("emissive"), "-o", folder, *FLAGS, "--dask", machines.address)
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    wait_for_lights(folder, 5, process)
    machines.workers[0].kill()
    _, err = process.communicate(timeout=240)
    assert process.returncode == 0, err
    assert contents(folder) == contents(plain)


@pytest.mark.blender
def test_a_stopped_dask_bake_is_gone_on_with_by_anyone(blend, machines: LocalCluster, plain: Path, tmp_path: Path) -> None:
    folder = tmp_path / "capture"
    command = srbf("bake", blend("emissive"), "-o", folder, *FLAGS, "--dask", machines.address)
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    wait_for_lights(folder, 3, process)
    os.kill(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=240)
    assert process.returncode == 1 and "resumes" in err and "Traceback" not in err
    assert Capture.open(folder).lights
    counted = int(re.search(r"(\d+) of 22 lights are done", run("bake", blend("emissive"), "-o", folder, *FLAGS).stderr)[1])
    assert counted >= 3
    assert contents(folder) == contents(plain)


@pytest.mark.blender
def test_dask_workers_fit_tiles(machines: LocalCluster, plain: Path, tmp_path: Path) -> None:
    run("fit", plain, "-o", tmp_path / "here", *FIT)
    run("fit", plain, "-o", tmp_path / "there", *FIT, "--dask", machines.address)
    here, there = (Asset.open(tmp_path / name) for name in ("here", "there"))
    scale = np.abs(here.coefficients()).max()
    np.testing.assert_allclose(there.coefficients(), here.coefficients(), rtol=0, atol=HALF * scale)
    assert there.manifest["error"]["holdout"]["psnr"] == pytest.approx(here.manifest["error"]["holdout"]["psnr"], abs=0.01)


@pytest.mark.blender
def test_parts_in_any_order_give_the_same_bits(blend, plain: Path, tmp_path: Path) -> None:
    folder = tmp_path / "capture"
    settings = BakeSettings(Receiver("lightmap", "Plane"), 24, 24, lights=20, samples=8, validation=1, holdout=1, holdout_samples=8)
    bake = Bake(blend("emissive"), folder, settings)
    with pytest.raises(BakeError, match="shard=prepare` first"):
        bake.run(Reporter(), shard=Shard(1, 3))
    assert bake.run(Reporter(), shard=Shard.parse("prepare"))
    assert bake.run(Reporter(), shard=Shard(3, 3))
    assert not (folder / "capture.json").exists()
    with hold_shard(folder, Shard(2, 3)), pytest.raises(BakeError, match="shards 2/3"):
        bake.run(Reporter())
    (folder / "lights" / ".0003.1234.partial.exr").write_bytes(b"of a machine that went away")
    assert bake.run(Reporter(), shard=Shard(1, 3))
    said: list[str] = []
    assert bake.run(Reporter(say=said.append))  # bakes what shard 2 would have
    assert any(re.search(r"1[45] of 22 lights are done", line) for line in said), said
    assert contents(folder) == contents(plain)
    assert not bake.run(Reporter(), shard=Shard(2, 3))  # a farm may repeat a task
    assert contents(folder) == contents(plain)


@pytest.mark.blender
def test_an_openjd_job_bakes_the_same_bits_and_fits(blend, plain: Path, tmp_path: Path) -> None:
    pytest.importorskip("openjd.cli")
    job = tmp_path / "job"
    run("bake", blend("emissive"), "-o", job, *FLAGS, "--farm", "openjd", "--farm-tasks", "2")
    openjd = [sys.executable, "-m", "openjd"]
    assert subprocess.run([*openjd, "check", str(job / "template.json")], capture_output=True).returncode == 0
    given = [f"file://{job / 'parameters.json'}", f"Python={sys.executable}", f"FitFlags={' '.join(FIT)}"]
    given += [f"Capture={tmp_path / 'a capture'}", f"Asset={tmp_path / 'asset'}"]
    given = [word for value in given for word in ("-p", value)]
    done = subprocess.run([*openjd, "run", str(job / "template.json"), *given], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout
    assert contents(tmp_path / "a capture") == contents(plain)
    capture, asset = Capture.open(plain), Asset.open(tmp_path / "asset")
    assert evaluate(asset, capture, roles=["holdout"])["holdout"]["relative_rmse"] < 1


def bake_of(folder: Path, time_limit: float | None = None, crew: WorkerPoolSettings | None = None, **settings: object) -> Bake:
    scene = folder / "scene.blend"
    scene.write_bytes(b"never opened")
    return Bake(
        scene,
        folder / "capture",
        BakeSettings(Receiver("lightmap", "A b"), 8, 8, **settings),
        None,
        crew or WorkerPoolSettings(),
        time_limit,
    )


def test_every_light_is_in_one_part() -> None:
    order = render_order(plan_lights(BakeSettings(Receiver("view"), lights=30)))
    for count in (1, 7, 100):
        lights = [light for number in range(1, count + 1) for light in Shard(number, count).of(order)]
        assert sorted(light.index for light in lights) == list(range(len(order)))
    assert Shard.parse("prepare").of(order) == []
    for text in ("0/3", "4/3", "1", "prepared", "1/3/5", "-1/3"):
        with pytest.raises(InputError, match="expected `shard` prepare or I/N"):
            Shard.parse(text)


def test_a_part_and_a_whole_bake_refuse_each_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("srbf.bake.folder.LOCK_PATIENCE", 0.1)
    with hold(tmp_path), pytest.raises(BakeError, match="process .* is baking all"), hold_shard(tmp_path, Shard(1, 2)):
        pass
    with hold_shard(tmp_path, Shard(1, 2)), hold_shard(tmp_path, Shard(2, 2)):
        with pytest.raises(BakeError, match="shard 1/2"), hold_shard(tmp_path, Shard(1, 2)):
            pass
        with pytest.raises(BakeError, match="shards of 3"), hold_shard(tmp_path, Shard(1, 3)):
            pass
        with pytest.raises(BakeError, match="shards 1/2, 2/2"), hold(tmp_path):
            pass
    with hold(tmp_path):
        pass
    assert not list(tmp_path.glob(".shard*"))


def test_a_pass_is_added_once_and_in_order(tmp_path: Path) -> None:
    light = plan_lights(BakeSettings(Receiver("view"), lights=1))[0]
    (tmp_path / "lights").mkdir()
    images, accumulation = CaptureImages(tmp_path), Accumulation(tmp_path, [light])
    for name in ("valid", "hit", "coverage", "position", "normal", "albedo"):
        images.take(name, np.ones((2, 3, 3), np.float32))
    images.prepare({"blender": "4.5"}, {}, None)
    first, second = (Task(light, 2, 5 + i, i, keep=True) for i in range(2))
    one, three = (Response(np.full((2, 3, 3), value, np.float32), None, 0.1) for value in (1.0, 3.0))
    assert add_pass(images, accumulation, second, three) is None  # the first is not in
    np.testing.assert_array_equal(add_pass(images, accumulation, first, one), one.whole)
    assert add_pass(images, accumulation, first, three) is None
    np.testing.assert_array_equal(add_pass(images, accumulation, second, three), 2 * one.whole)
    assert (accumulation.passes(light), accumulation.samples(light)) == (2, 4)
    with pytest.raises(BakeError, match="values of light 0"):
        add_pass(images, accumulation, Task(light, 2, 7, 2), Response(np.ones((3, 3, 3), np.float32), None, 0.1))
    assert Accumulation(tmp_path, [light]).refresh(light, 2) and not accumulation.refresh(light, 3)


@pytest.mark.slow
def test_what_a_farm_cannot_do_is_refused_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("srbf.compute.dask_client.CONNECTING", 1.0)
    for bake in (bake_of(tmp_path, samples="auto"), bake_of(tmp_path, time_limit=60.0)):
        with pytest.raises(InputError, match="fixed number of `samples`.*found `samples=auto` or `time_limit`"):
            template(bake)
        with pytest.raises(InputError, match="fixed number of `samples`.*found `samples=auto` or `time_limit`"):
            bake.run(Reporter(), shard=Shard(1, 2))
    with pytest.raises(InputError, match="rename"):
        template(Bake(bake_of(tmp_path).scene, tmp_path / "c", BakeSettings(Receiver("lightmap", "{{Param.Scene}}"))))
    with pytest.raises(InputError, match="tcp://"):
        checked("localhost:8786")
    with pytest.raises(ClusterError, match="expected a dask scheduler at tcp://127.0.0.1:9"), Cluster("tcp://127.0.0.1:9"):
        pass
    elsewhere = FitRun(solve_rows=lambda *given: pytest.fail("another method has no independent rows"))
    with pytest.raises(InputError, match="relighting-map.*eigen-map"):
        encode(EigenMap(), write_capture(tmp_path / "capture", lambda d: np.ones((2, 2, 3)), lights=12), elsewhere)
    for flags in (["--shard", "1/2", "--dask", "tcp://x:1"], ["--dask", "tcp://x:1", "--workers", "2"], ["--shard", "1/2", "--force"]):
        words = srbf("bake", tmp_path / "scene.blend", "-o", tmp_path / "x", "--receiver", "view", *flags)
        refused = subprocess.run(words, capture_output=True, text=True)
        assert refused.returncode == 2 and len(refused.stderr.strip().splitlines()) == 1 and not (tmp_path / "x").exists()


def test_a_job_says_all_that_decides_a_pixel(tmp_path: Path) -> None:
    settings = {
        "width": 8,
        "height": 9,
        "lights": 77,
        "samples": 3,
        "seed": 5,
        "sun_angle": 0.1 + 0.2,
        "keep_scene_lights": True,
        "no_shadow": ("Roof",),
        "scene": "Night shot",
        "quantity": "radiance",
    }
    flags = arguments(BakeSettings(Receiver("lightmap", "A b", "UV 2"), **settings))
    for flag in (
        "--receiver=lightmap:A b",
        "--uv-layer=UV 2",
        "--size=8x9",
        f"--sun-angle={0.1 + 0.2!r}",
        "--keep-scene-lights",
        "--samples=3",
    ):
        assert flag in flags
    named = {flag.partition("=")[0].removeprefix("--").replace("-", "_") for flag in flags}
    missing = (
        set(BakeSettings.__dataclass_fields__)
        - named
        - {"width", "height", "light_list", "points", "light_set", "denoise", "no_shadow", "gloss", "step"}
    )
    assert not missing and "--no-cast-shadow=Roof" in flags
    assert "--share=1/4" in arguments(BakeSettings(Receiver("view"), width=8, height=8, samples=1, step=2))
    assert "--denoise" in arguments(BakeSettings(Receiver("view"), denoise=True))
    atlas = Receiver("lightmap", "A", also=("B",))
    assert {"--receiver=lightmap:A", "--receiver=lightmap:B"} <= set(arguments(BakeSettings(atlas)))
    point_lights = PointGrid(0.1 + 0.2, (-1.0, 0.0, 0.1, 1.0, 2.0, 1 / 3), ((0.0, 0.0, 0.0),))
    flags = arguments(BakeSettings(Receiver("view"), points=point_lights))
    (light_set,) = (flag.removeprefix("--light-set=") for flag in flags if flag.startswith("--light-set="))
    (light_box,) = (flag.removeprefix("--light-bounds=") for flag in flags if flag.startswith("--light-bounds="))
    assert PointGrid.parse(light_set, light_box) == PointGrid(point_lights.spacing, point_lights.box)
    job = template(bake_of(tmp_path, lights=77), None)
    assert [step["name"] for step in job["steps"]] == ["Prepare", "Bake", "Finish", "Fit"]
    assert job["steps"][1]["parameterSpace"]["taskParameterDefinitions"][0]["range"] == "1-4"  # 125 lights
    (tmp_path / "some.lp").write_text("1\na.png 0 0 1\n")
    listed = template(bake_of(tmp_path, light_list=tmp_path / "some.lp"))
    assert [entry["default"] for entry in listed["parameterDefinitions"] if entry["name"] == "LightList"] == [LIGHT_LIST]


@pytest.mark.parametrize(
    ("light_set", "expected"),
    [
        (NamedSet(("Hall", "Yard"), (("Hall", ()),)), ["--light-set=named", "--light-group=Hall", "--light-group=Yard"]),
        (CloudSet("cloud", 77, 0.5, (0, 0, 0, 1, 2, 3)), ["--light-set=cloud", "--lights=77", "--grid=0.5", "--light-bounds=0,0,0,1,2,3"]),
        (CloudSet("patches", 300), ["--light-set=patches", "--patches=300", "--transport=indirect", "--samples=2"]),
        (CloudSet("surfels", 300, 0.5), ["--light-set=surfels", "--surfels-per-m2=4.0", "--transport=indirect"]),
    ],
)
def test_a_job_of_a_light_set_says_what_it_is(light_set: NamedSet | CloudSet, expected: list[str]) -> None:
    flags = arguments(BakeSettings(Receiver("lightmap", "A"), transport="indirect", light_set=light_set))
    assert set(expected) <= set(flags)
    refused = {"--domain", *(("--lights", "--samples") if light_set.kind == "surfels" else ())}
    assert not refused & {flag.partition("=")[0] for flag in flags}
    if light_set.kind == "cloud":
        glossy = BakeSettings(Receiver("lightmap", "A"), light_set=light_set, quantity="radiance", gloss=2)
        assert {*expected, "--gloss=2", "--quantity=radiance"} <= set(arguments(glossy))


def test_a_job_of_a_gather_says_samples_or_a_pool() -> None:
    view = BakeSettings(Receiver("view"), transport="indirect", quantity="radiance", light_set=GatherSet(500, 40))
    assert {"--light-set=gather", "--pool=500", "--view-clusters=40"} <= set(arguments(view))
    sampled = arguments(replace(view, light_set=GatherSet(clusters=40, gather=120)))
    assert "--gather=120" in sampled and not any(flag.startswith("--pool") for flag in sampled)
