"""The wheel in an empty environment does what the checkout does: no compiler, no Node.js, no Blender, no checkout."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from environments import BIN, ROOT, Distribution, Environment, succeed
from made_assets import build_asset

import srbf
from srbf.export import exr

pytestmark = pytest.mark.packaging


@pytest.fixture(scope="module")
def asset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("made") / "asset"
    folder.mkdir()
    exr.write(build_asset(), folder)
    return folder


def test_it_imports_from_the_environment(installed: Environment) -> None:
    found = succeed(installed.python("-c", "import srbf; print(srbf.__file__)")).stdout.strip()
    assert Path(found).resolve().is_relative_to(installed.root.resolve())


def test_version_and_info(installed: Environment, asset: Path) -> None:
    assert succeed(installed.srbf("--version")).stdout.strip() == f"srbf {srbf.__version__}"
    assert "relighting-map" in succeed(installed.srbf("info", asset)).stdout


def test_relight_and_exports_that_read_files_of_the_package(installed: Environment, asset: Path, tmp_path: Path) -> None:
    succeed(installed.srbf("relight", asset, "--directional", "0,0.5,1", "-o", tmp_path / "lit.png"))
    assert (tmp_path / "lit.png").read_bytes().startswith(b"\x89PNG")
    succeed(installed.srbf("export", asset, "--target", "godot", "-o", tmp_path / "godot"))
    assert any((tmp_path / "godot").rglob("*.gdshaderinc"))


def test_export_of_a_site(installed: Environment, asset: Path, tmp_path: Path) -> None:
    succeed(installed.srbf("export", asset, "--target", "web", "-o", tmp_path / "site"))
    assert "<html" in (tmp_path / "site" / "index.html").read_text(encoding="utf-8")
    assert (tmp_path / "site" / "viewer.js").stat().st_size > 100_000


@contextmanager
def served(installed: Environment, asset: Path) -> Iterator[str]:
    """The address at which `srbf view` serves."""
    process = subprocess.Popen(
        [installed.root / BIN / "srbf", "view", asset, "--no-browser"],
        cwd=installed.nowhere, env={**os.environ, "PYTHONPATH": "", "PYTHONUNBUFFERED": "1"}, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout is not None
    try:
        yield process.stdout.readline().strip()
    finally:
        process.terminate() if sys.platform == "win32" else process.send_signal(signal.SIGINT)
        process.wait(30)
        process.stdout.close()


def test_view_serves_the_page(installed: Environment, asset: Path) -> None:
    with served(installed, asset) as url:
        for name, within in {"": b"<html", "viewer.js": b"srbf"}.items():
            with urllib.request.urlopen(url + name, timeout=30) as response:
                assert within in response.read()


@pytest.mark.parametrize("command", [["demo", "-o", "out"], ["bake", "scene.blend", "-o", "capture", "--receiver", "view"]])
def test_without_srbf_blender_one_line_says_what_to_install(installed: Environment, command: list[str], tmp_path: Path) -> None:
    (tmp_path / "scene.blend").write_bytes(b"BLENDER-v405")
    words = [tmp_path / word if "." in word or word in ("out", "capture") else word for word in command]
    done = installed.srbf(*words)
    assert done.returncode == 1
    (line,) = (line for line in done.stderr.splitlines() if "srbf[blender]" in line)
    assert "srbf-blender" in line
    assert "Traceback" not in done.stderr


def test_srbf_blender_brings_the_worker_and_the_scenes(
    srbf_built: Distribution, blender_built: Distribution, installed: Environment, tmp_path: Path
) -> None:
    """Into a folder of its own, so that the environment stays without it."""
    succeed(installed.python("-m", "pip", "install", "--no-deps", "--target", tmp_path, blender_built.wheel))
    script = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); from srbf.demo import scene_script; print(scene_script('caustics'))"
    found = Path(succeed(installed.python("-c", script)).stdout.strip())
    assert found.resolve() == (tmp_path / "blender_bake" / "scenes" / "caustics.py").resolve()
    assert (tmp_path / "blender_bake" / "scenes" / "staging.py").is_file()  # which it imports


def test_the_extra_finds_its_own_version(srbf_built: Distribution, blender_built: Distribution, empty: Environment) -> None:
    """All that srbf[blender] needs exists as wheels; nothing is installed."""
    links = ["--find-links", blender_built.wheel.parent]
    asked = f"{srbf_built.wheel}[blender,gl,ray,export,report]"
    done = succeed(empty.python("-m", "pip", "install", "--dry-run", "--only-binary", ":all:", *links, asked))
    assert f"srbf-blender-{srbf.__version__}" in done.stdout


@pytest.fixture
def clone(tmp_path: Path) -> Path:
    """What a build reads of a fresh clone, which has no page."""
    folder = tmp_path / "clone"
    for name in ("pyproject.toml", "hatch_build.py", "README.md", "LICENSE", "srbf/__init__.py", "glsl/README.md"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes((ROOT / name).read_bytes())
    for name in ("engines", "web"):
        (folder / name).mkdir()
    return folder


def test_without_page_and_node_a_build_says_so_in_one_line(clone: Path, empty: Environment, tmp_path: Path) -> None:
    done = empty.python("-m", "pip", "wheel", "--no-deps", "--wheel-dir", tmp_path, clone)
    assert done.returncode
    said = [line.strip() for line in (done.stdout + done.stderr).splitlines() if "viewer's page" in line]
    assert len(said) == 1 and "found no page and no npm; install Node.js" in said[0]
    assert "Traceback" not in done.stdout + done.stderr


def test_an_editable_install_needs_no_page(clone: Path, empty: Environment, tmp_path: Path) -> None:
    succeed(empty.python("-m", "pip", "install", "--no-deps", "--target", tmp_path / "site", "--editable", clone))
    assert str(clone) in "".join(path.read_text() for path in (tmp_path / "site").glob("*.pth"))
