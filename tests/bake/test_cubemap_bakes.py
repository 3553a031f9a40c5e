"""Bakes under a cubemap: beside Cycles, sparse beside full, stopped in every stage and resumed, what the command line says and refuses."""

from __future__ import annotations

import json
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from light_set_commands import done, of_a_process, refused, scenes_in

from srbf.bake.light_sets import LIGHT_SET_FILE
from srbf.capture import COVERED, Capture
from srbf.cubemap import Cubemap
from srbf.cubemap_transport import BOUNCES_FILE, VISIBILITY_FILE

pytestmark = pytest.mark.blender

FLOOR = ["--receiver", "lightmap:Floor", "--size", "24"]
CUBEMAP = [*FLOOR, "--light-set", "cubemap:4", "--validation", "1", "--holdout", "2", "--seed", "77"]
EDGES = 0.12  # relative RMSE: Cycles averages the footprint of each texel, rays see its middle
STAGES = (LIGHT_SET_FILE, VISIBILITY_FILE, BOUNCES_FILE)
# Random free places, which say what is outside of solids, in the open air these do; surfels; and rays from each of these and to each texel.
FEW = {"bake.light_sets.SURFEL_PLACES": 512, "bake.cubemap_set.SURFELS": 500, "visibility.distant_bounces.SURFEL_RAYS": 512}
FEW |= {"visibility.transfer_operator.MOST_RAYS": 1024}


@pytest.fixture(scope="module", autouse=True)
def few_places_and_rays() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        for name, few in FEW.items():
            patch.setattr(f"srbf.{name}", few)
        yield


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    return scenes_in(tmp_path_factory)


@pytest.fixture(scope="module")
def whole(scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("whole") / "capture"
    line = done("bake", scene("open_air"), "-o", folder, *CUBEMAP, "--full", "--json-progress").stderr.splitlines()[-1]
    assert set(json.loads(line)) == {"rays", "cpu_seconds", "sampled"} and json.loads(line)["sampled"] == 1
    return folder


def same(one: Path, other: Path) -> None:
    """All that two captures hold, except how long they took."""
    assert (one / "capture.json").read_bytes() == (other / "capture.json").read_bytes()
    for name in (VISIBILITY_FILE, BOUNCES_FILE):
        with np.load(one / name) as a, np.load(other / name) as b:
            for key in set(a) - {"cpu_seconds"}:
                np.testing.assert_array_equal(a[key], b[key])
    for image in sorted((one / "lights").iterdir()):
        assert image.read_bytes() == (other / "lights" / image.name).read_bytes()


def test_a_capture_is_that_of_cycles(whole: Path, scene, tmp_path: Path) -> None:
    capture, chosen = Capture.open(whole), [66, 69, 70, 77]  # from above
    assert len(capture.indices("train")) == 96 and [len(capture.indices(role)) for role in ("validation", "holdout")] == [1, 2]
    directions = Cubemap(4).directions[chosen]
    lines = [str(len(chosen)), *(f"{i}.png {x:.9g} {y:.9g} {z:.9g}" for i, (x, y, z) in enumerate(directions.tolist()))]
    (tmp_path / "lights.lp").write_text("\n".join(lines) + "\n")
    words = ["--light-list", tmp_path / "lights.lp", "--samples", "256", "--validation", "0", "--holdout", "0"]
    done("bake", scene("open_air"), "-o", tmp_path / "cycles", *FLOOR, *words)
    rendered = Capture.open(tmp_path / "cycles")
    covered = capture.coverage() >= COVERED
    for index, column in enumerate(chosen):
        true, found = rendered.image(index)[covered], capture.image(column)[covered]
        assert np.linalg.norm(found - true) < EDGES * np.linalg.norm(true)
        assert abs(found.sum() / true.sum() - 1) < 0.02


def test_sparse_sampling_is_near_the_full_one_and_reproducible(whole: Path, scene, tmp_path: Path) -> None:
    for name in ("one", "two"):
        done("bake", scene("open_air"), "-o", tmp_path / name, *CUBEMAP, "--sparse")
    same(tmp_path / "one", tmp_path / "two")
    sparse, full = Capture.open(tmp_path / "one"), Capture.open(whole)
    told = sparse.manifest["cubemap"]
    assert told["sampling"] == "neighbors" and told["rays"] < full.manifest["cubemap"]["rays"] and told["sampled"] < 1
    train = full.indices("train")
    truth, found = (np.concatenate([block.copy() for _, block in one.blocks(train)]) for one in (full, sparse))
    assert np.linalg.norm(found - truth) < 0.1 * np.linalg.norm(truth)


@pytest.mark.parametrize("stage", STAGES)
def test_a_bake_killed_after_a_stage_resumes(whole: Path, scene, tmp_path: Path, stage: str) -> None:
    folder = tmp_path / "killed"
    words = ["bake", scene("open_air"), "-o", folder, *CUBEMAP, "--full"]
    process = subprocess.Popen(of_a_process(*words, few=FEW), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 120
    while not (folder / stage).is_file() and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.005)
    process.kill()
    process.wait()
    assert (folder / stage).is_file()
    kept = (folder / stage).stat().st_mtime_ns
    done(*words)
    same(whole, folder)
    assert (folder / stage).stat().st_mtime_ns == kept


def test_a_damaged_stage_is_made_again_where_the_bake_is_not_finished(whole: Path, scene, tmp_path: Path) -> None:
    """A finished capture is left alone; `--force` replaces it."""
    shutil.copytree(whole, tmp_path / "damaged")
    assert "complete already" in done("bake", scene("open_air"), "-o", tmp_path / "damaged", *CUBEMAP, "--full").stderr
    (tmp_path / "damaged" / VISIBILITY_FILE).write_bytes(b"no")
    done("bake", scene("open_air"), "-o", tmp_path / "damaged", *CUBEMAP, "--full", "--force")
    same(whole, tmp_path / "damaged")


def test_a_fit_relights_and_reports_a_held_out_error(whole: Path, tmp_path: Path) -> None:
    done("fit", whole, "-o", tmp_path / "asset", "--budget", "16")
    errors = json.loads(done("evaluate", tmp_path / "asset", whole, "--json").stdout)
    assert 0 < errors["holdout"]["relative_rmse"] < 0.6  # lights are 20 degrees apart
    done("relight", tmp_path / "asset", "--directional", "0.3,0.2,1", "-o", tmp_path / "image.exr")


def test_indirect_transport_and_vertices(scene, tmp_path: Path) -> None:
    words = ["--receiver", "vertices:Crate", "--light-set", "cubemap:4", "--validation", "0", "--holdout", "1"]
    done("bake", scene("open_air"), "-o", tmp_path / "capture", *words, "--transport", "indirect")
    capture = Capture.open(tmp_path / "capture")
    assert capture.transport == "indirect" and capture.has_direct and capture.manifest["cubemap"]["sampling"] == "full"
    up = int(Cubemap(4).texel_of(np.array([[0.1, 0.1, 1.0]]))[0])
    assert capture.combined().image(up).sum() > capture.image(up).sum() > 0


def test_receivers_inside_another_mesh_are_counted_and_black(scene, tmp_path: Path) -> None:
    """The crate stands on the floor, of which it hides a ninth from all light; some texels are at its edge."""
    said = done("bake", scene("open_air"), "-o", tmp_path / "capture", *CUBEMAP).stderr
    (line,) = [line for line in said.splitlines() if "see nothing" in line]
    dark, count = (int(word) for word in line.removeprefix("srbf: ").split()[:3:2])
    capture = Capture.open(tmp_path / "capture")
    covered = capture.coverage() >= COVERED
    brightest = np.max([capture.image(i)[covered].max(axis=1) for i in capture.indices("train")], axis=0)
    assert count == covered.sum() and dark == (brightest < 1e-3).sum() and abs(dark / count - 1 / 9) < 0.03


def test_a_dry_run_says_what_it_would_trace(scene, tmp_path: Path) -> None:
    output = done("bake", scene("open_air"), "-o", tmp_path / "dry", *CUBEMAP, "--dry-run").output
    assert "cubemap" in output and not (tmp_path / "dry").exists()


@pytest.mark.parametrize(
    ("words", "status", "said"),
    [
        ([*FLOOR, "--light-set", "cubemap:1"], 2, "2 to 64 texels"),
        ([*FLOOR, "--light-set", "cubemap:many"], 2, "cubemap:SIDE"),
        ([*FLOOR, "--light-set", "cubemap:4", "--patches", "9"], 2, "--patches"),
        ([*FLOOR, "--light-set", "cubemap:4", "--sun-angle", "0.1"], 2, "--sun-angle"),
        ([*FLOOR, "--light-set", "cubemap:4", "--shard", "prepare"], 2, "--shard"),
        (["--receiver", "view", "--light-set", "cubemap:4"], 2, "lightmap:OBJECT or vertices:OBJECT"),
        ([*FLOOR, "--sparse"], 2, "--sparse"),
        ([*FLOOR, "--light-set", "surfels", "--transport", "indirect", "--full"], 2, "--full"),
        (["--receiver", "vertices:Nothing", "--light-set", "cubemap:4"], 1, "Nothing"),
    ],
)
def test_other_flags_are_refused_in_one_line(scene, tmp_path: Path, words: list[object], status: int, said: str) -> None:
    assert said in refused(["bake", scene("open_air"), "-o", tmp_path / "no", *words], status)
    assert not (tmp_path / "no").exists()


@pytest.mark.parametrize("name", ["plane", "block"])
def test_a_convex_scene_has_direct_light_alone(scene, tmp_path: Path, name: str) -> None:
    """Texels of a face of normal n get n . l. No place within the bounds of these scenes is free."""
    done("bake", scene(name), "-o", tmp_path / "capture", *CUBEMAP)
    capture = Capture.open(tmp_path / "capture")
    covered = capture.coverage() >= COVERED
    images = np.stack([capture.image(i)[covered] for i in capture.indices("train")])
    normals = np.array([[0, 0, 1]]) if name == "plane" else np.concatenate([np.eye(3), -np.eye(3)])
    expected = np.maximum(Cubemap(4).directions @ normals.T, 0)  # (N, n)
    off = np.abs(images[:, :, 0][:, :, None] - expected[:, None]).max(axis=0).min(axis=1)
    assert off.max() < 1e-5
    done("fit", tmp_path / "capture", "-o", tmp_path / "asset", "--budget", "16")


def test_a_scene_that_nothing_reflects_in_is_refused_in_one_line(scene, tmp_path: Path) -> None:
    assert ": expected" in refused(["bake", scene("black"), "-o", tmp_path / "no", *CUBEMAP])
    assert not (tmp_path / "no" / "capture.json").exists()
