"""A .blend that tries to run code and to write files: nothing runs, nothing outside the capture changes, no pixel either."""

from __future__ import annotations

import hashlib
import importlib.metadata
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.blender

ROOT = Path(__file__).parents[2]
SCENE = ROOT / "data" / "scenes" / "hostile.py"
CONFINE = ROOT / "blender_bake" / "sandbox.py"
SMALL = ["--size", "8", "--lights", "4", "--samples", "2", "--validation", "0", "--holdout", "1", "--holdout-samples", "4"]


def python(script: Path, *arguments: object, check: bool = True, **environment: str) -> subprocess.CompletedProcess[str]:
    line = [sys.executable, str(script), *map(str, arguments)]
    return subprocess.run(line, check=check, capture_output=True, text=True, timeout=120, env={**os.environ, **environment})


def bake(scene: Path, folder: Path, receiver: str, **environment: str) -> subprocess.CompletedProcess[str]:
    line = [sys.executable, "-m", "srbf", "bake", str(scene), "-o", str(folder), "--receiver", receiver, *SMALL]
    return subprocess.run(line, capture_output=True, text=True, timeout=120, env={**os.environ, **environment})


def snapshot(folder: Path) -> dict[str, str]:
    """Every file by its checksum, every folder by its name."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else "folder"
        for path in sorted(folder.rglob("*"))
    }


def images(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*.exr")}


class Sandbox:
    """A home, a temporary folder, a scene's folder and one for canaries; nothing else of this machine is named to what runs here."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.canaries, self.home, self.temporary = folder / "canaries", folder / "home", folder / "temporary"
        for made in (self.canaries, self.home, self.temporary):
            made.mkdir(parents=True)
        self.environment = {"HOME": str(self.home), "TMPDIR": str(self.temporary)}

    def build(self, *attempts: str) -> Path:
        """The scene, built elsewhere than where it is opened: what building it leaves is none of its canaries."""
        path = self.folder / "scene" / "hostile.blend"
        python(SCENE, "build", path, self.canaries, *attempts)
        for left in [*self.canaries.iterdir(), *path.parent.glob("blendcache_*/*"), *path.parent.glob("*.blend1")]:
            left.unlink()
        for left in path.parent.glob("blendcache_*"):
            left.rmdir()
        return path


def attempts() -> list[str]:
    return python(SCENE, "list").stdout.split()


def test_a_careless_program_falls_for_every_attempt(tmp_path: Path) -> None:
    """Else the other tests here could not fail."""
    sandbox = Sandbox(tmp_path)
    expected = set(attempts()) - {"fluid_replay"}
    if not importlib.metadata.version("bpy").startswith("4."):
        expected.remove("open_shading")  # the module of 5.2 comes without what makes sockets for a script
    scene = sandbox.build(*expected)
    before = snapshot(tmp_path)
    python(SCENE, "trust", scene, **sandbox.environment)
    found = "\n".join(set(snapshot(tmp_path)) - set(before)).replace("cached_RR", "render_cache")
    assert {name for name in expected if name in found} == expected


def test_a_careless_program_falls_for_the_fluid(tmp_path: Path) -> None:
    sandbox = Sandbox(tmp_path)
    done = python(SCENE, "trust", sandbox.build("fluid_replay"), check=False, **sandbox.environment)
    assert done.returncode < 0 or (sandbox.canaries / "fluid_replay").exists()


@pytest.fixture(scope="module")
def twins(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, bytes]]:
    """The images of the scene without any attempt, by receiver."""
    folder = tmp_path_factory.mktemp("twin")
    scene = Sandbox(folder).build("none")
    baked = {}
    for receiver in ("lightmap:Plane", "view:Camera"):
        assert bake(scene, folder / "capture", receiver).returncode == 0
        baked[receiver] = images(folder / "capture")
        (folder / "capture").rename(folder / receiver.partition(":")[0])
    return baked


@pytest.mark.parametrize("walls", ["both", "first"])
@pytest.mark.parametrize("receiver", ["lightmap:Plane", "view:Camera"])
def test_nothing_runs_and_nothing_outside_the_capture_changes(
    tmp_path: Path, twins: dict[str, dict[str, bytes]], receiver: str, walls: str
) -> None:
    sandbox = Sandbox(tmp_path / "sandbox")
    scene = sandbox.build()
    before = snapshot(sandbox.folder)
    alone = {"SRBF_UNCONFINED": "1"} if walls == "first" else {}
    done = bake(scene, tmp_path / "capture", receiver, **sandbox.environment, **alone)
    assert done.returncode == 0, done.stderr
    assert snapshot(sandbox.folder) == before
    assert images(tmp_path / "capture") == twins[receiver]
    for words in ("drivers that need Python", "'Wall' location", "OSL scripts", "camera 'Lens'", "fluids"):
        assert words in done.stderr
    assert "\x1b[2J" not in done.stderr and "two\nlines" not in done.stderr


@pytest.mark.parametrize("walls", ["both", "first"])
def test_an_unfinished_disk_cache_is_left_as_it_is(tmp_path: Path, walls: str) -> None:
    sandbox = Sandbox(tmp_path / "sandbox")
    scene = sandbox.build("cloth_cache")
    python(SCENE, "trust", scene, **sandbox.environment)
    before = snapshot(scene.parent)
    assert any("blendcache" in name for name in before)
    if walls == "first":
        done = bake(scene, tmp_path / "capture", "lightmap:Plane", **sandbox.environment, SRBF_UNCONFINED="1")
        assert done.returncode == 1 and len(done.stderr.strip().splitlines()) == 1
        assert "'Cloth'" in done.stderr and "Disk Cache" in done.stderr
    elif not has_landlock(tmp_path):
        pytest.skip("this system has no Landlock")
    else:
        assert bake(scene, tmp_path / "capture", "lightmap:Plane", **sandbox.environment).returncode == 0
    assert snapshot(scene.parent) == before


@pytest.mark.parametrize("kind", ["empty", "garbage", "text", "head", "middle", "tail", "flipped", "folder"])
def test_a_damaged_file_is_one_line(tmp_path: Path, kind: str) -> None:
    sandbox = Sandbox(tmp_path)
    whole = sandbox.build("none").read_bytes()
    middle = len(whole) // 2
    damaged = tmp_path / "damaged.blend"
    if kind == "folder":
        damaged.mkdir()
    else:
        damaged.write_bytes(
            {
                "empty": b"",
                "garbage": hashlib.shake_256(b"garbage").digest(100_000),
                "text": b"BLENDER-v405 but no more",
                "head": whole[:40],
                "middle": whole[:middle],
                "tail": whole[:-5000],
                "flipped": whole[:200] + bytes(255 - byte for byte in whole[200:middle]) + whole[middle:],
            }[kind]
        )
    done = bake(damaged, tmp_path / "capture", "lightmap:Plane")
    assert done.returncode == 1 and len(done.stderr.strip().splitlines()) == 1 and "Traceback" not in done.stderr, done.stderr
    assert "damaged.blend" in done.stderr
    assert not (tmp_path / "capture" / "capture.json").exists()


def has_landlock(folder: Path) -> bool:
    source = "import os; print(os.environ.get('SRBF_CONFINED'))"
    return python(CONFINE, folder, sys.executable, "-c", source).stdout.strip() == "1"


@pytest.mark.skipif(sys.platform != "linux", reason="Landlock is Linux's")
def test_the_second_wall(tmp_path: Path) -> None:
    """Whatever runs behind it: no file, folder, link, renaming or removal outside, no cut, no connection; reading stays free."""
    inside, outside = tmp_path / "inside", tmp_path / "outside"
    inside.mkdir()
    outside.mkdir()
    (outside / "file").write_text("kept")
    if not has_landlock(inside):
        pytest.skip("this system has no Landlock")
    source = f"""
import os, socket, subprocess
inside, outside = {str(inside)!r}, {str(outside)!r}
open(inside + '/file', 'w').write('x')
os.mkdir(inside + '/folder')
open(os.devnull, 'w').write('x')
assert open(outside + '/file').read() == 'kept'
for strike in (
    lambda: open(outside + '/new', 'w'),
    lambda: open(outside + '/file', 'a'),
    lambda: os.truncate(outside + '/file', 0),
    lambda: os.mkdir(outside + '/folder'),
    lambda: os.symlink(outside, outside + '/link'),
    lambda: os.rename(outside + '/file', inside + '/taken'),
    lambda: os.rename(inside + '/file', outside + '/put'),
    lambda: os.remove(outside + '/file'),
    lambda: socket.create_connection(('127.0.0.1', 9)),
):
    try:
        strike()
    except PermissionError:
        continue
    raise SystemExit('not refused')
raise SystemExit(subprocess.call(['touch', outside + '/child'], stderr=subprocess.DEVNULL) == 0)
"""
    python(CONFINE, inside, sys.executable, "-c", source)
    assert snapshot(outside) == {"file": hashlib.sha256(b"kept").hexdigest()}
    assert (inside / "folder").is_dir()
