"""The extension's zip, built and validated by Blender's own tool; wheels stand in for those that pip would fetch."""

from __future__ import annotations

import importlib.util
import tomllib
import zipfile
from pathlib import Path

import pytest

pytestmark = pytest.mark.blender
ROOT = Path(__file__).parents[2]
OWN = ["srbf-0.1.0-py3-none-any.whl", "srbf_blender-0.1.0-py3-none-any.whl"]
FETCHED = ["numpy-2.3.0-cp313-cp313-win_amd64.whl", "scipy-1.17.0-cp313-cp313-win_amd64.whl", "rich-15.0.0-py3-none-any.whl"]


@pytest.fixture
def building(monkeypatch):
    spec = importlib.util.spec_from_file_location("build_extension", ROOT / "scripts" / "build_extension.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    calls = []

    def pip(*arguments):
        calls.append([str(word) for word in arguments])
        names = OWN if arguments[0] == "wheel" else FETCHED
        folder = Path(arguments[arguments.index("--wheel-dir" if arguments[0] == "wheel" else "--dest") + 1])
        folder.mkdir(exist_ok=True)
        for name in names:
            zipfile.ZipFile(folder / name, "w").close()

    monkeypatch.setattr(module, "_pip", pip)
    module.calls = calls
    return module


def test_the_zip_builds_and_validates(building, tmp_path) -> None:
    path = building.build(tmp_path / "work", tmp_path, "windows-x64", "3.13", "5.1.0", None)
    with zipfile.ZipFile(path) as archive:
        names = set(archive.namelist())
        manifest = tomllib.loads(archive.read("blender_manifest.toml").decode())
        assert b"GNU GENERAL PUBLIC LICENSE" in archive.read("LICENSE")
    kept = {f"wheels/{name}" for name in [*FETCHED[1:], *OWN]}
    assert {name for name in names if name.endswith(".whl")} == kept == {name.removeprefix("./") for name in manifest["wheels"]}
    assert {path.name for path in (ROOT / "blender_extension").glob("*.py")} == {name for name in names if name.endswith(".py")}
    assert (manifest["version"], manifest["blender_version_min"], manifest["platforms"]) == ("0.1.0", "5.1.0", ["windows-x64"])


def test_what_is_fetched_is_what_the_library_needs(building, tmp_path) -> None:
    building.build(tmp_path / "work", tmp_path, "linux-x64", "3.11", "4.2.0", "5.1.0")
    fetched = {word.split(">")[0].split("=")[0].split("<")[0] for word in building.calls[1]}
    assert {"numpy", "scipy", "OpenImageIO", "jsonschema", "typer", "rich", "filelock"} <= fetched
    assert "scikit-learn" not in fetched
    image_library = next(word for word in building.calls[1] if word.startswith("OpenImageIO"))
    assert "<3.1" in image_library  # Blender 4.5 brings numpy 1


def test_a_broken_manifest_is_refused(building, tmp_path, monkeypatch) -> None:
    monkeypatch.setitem(building.PLATFORMS, "amiga", ["any"])
    with pytest.raises(building.subprocess.CalledProcessError):
        building.build(tmp_path / "work", tmp_path, "amiga", "3.11", "four", None)
