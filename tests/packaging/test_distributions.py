"""What the two distributions hold, and what they say of themselves."""

from __future__ import annotations

import json
import re
import tarfile
import tomllib
import zipfile
from email import message_from_string
from email.message import Message
from pathlib import Path

import pytest
from environments import ROOT, Distribution

import srbf

pytestmark = pytest.mark.packaging
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
BLENDER = tomllib.loads((ROOT / "blender_bake" / "pyproject.toml").read_text(encoding="utf-8"))["project"]
PAGE = {f"srbf/viewer/page/{name}" for name in ("index.html", "viewer.js", "viewer.css", "LICENSES.txt")}
SCENES = {
    "caustics",
    "coin",
    "colored_room",
    "house",
    "interior",
    "lattice",
    "lightmap_charts",
    "loft",
    "loft_furniture",
    "staging",
    "still_life",
}
MEDIA = {".webp", ".png", ".exr", ".jpg", ".mp4"}
SDIST_BYTES = 2_000_000  # 1.0 MB when written; 7.8 MB with the pictures of the documentation


def wheel_names(wheel: Path) -> set[str]:
    with zipfile.ZipFile(wheel) as archive:
        return set(archive.namelist())


def sdist_names(sdist: Path) -> set[str]:
    with tarfile.open(sdist) as archive:
        return {name.partition("/")[2] for name in archive.getnames()}


def metadata(wheel: Path) -> Message:
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        return message_from_string(archive.read(name).decode("utf-8"))


def tracked(folder: str) -> set[str]:
    """The files of a folder of the checkout, without caches."""
    return {path.relative_to(ROOT).as_posix() for path in (ROOT / folder).rglob("*") if path.is_file() and "__pycache__" not in path.parts}


def test_sdist_and_wheel_hold_the_page(srbf_built: Distribution) -> None:
    assert sdist_names(srbf_built.sdist) >= PAGE
    assert wheel_names(srbf_built.wheel) >= PAGE


def test_the_wheel_holds_the_library_and_what_it_reads(srbf_built: Distribution) -> None:
    names = wheel_names(srbf_built.wheel)
    assert {name for name in tracked("srbf") if not name.startswith("srbf/viewer/page/")} <= names
    assert {f"srbf/{name}" for name in tracked("glsl")} <= names
    assert "srbf/py.typed" in names


def test_the_mit_distribution_holds_nothing_of_the_gpl_one(srbf_built: Distribution) -> None:
    for names in (wheel_names(srbf_built.wheel), sdist_names(srbf_built.sdist)):
        assert not [name for name in names if re.search("blender_bake|blender_extension|scenes/|GPL", name)]
    with zipfile.ZipFile(srbf_built.wheel) as archive:
        texts = {name: archive.read(name) for name in archive.namelist() if name.endswith(".py")}
    assert not [name for name, text in texts.items() if b"SPDX-License-Identifier: GPL" in text]


def test_the_sdist_holds_no_media(srbf_built: Distribution) -> None:
    assert not [name for name in sdist_names(srbf_built.sdist) if Path(name).suffix in MEDIA]
    assert srbf_built.sdist.stat().st_size < SDIST_BYTES


def test_srbf_blender_holds_the_worker_and_the_users_scenes(blender_built: Distribution) -> None:
    names = wheel_names(blender_built.wheel)
    worker = {name for name in tracked("blender_bake") if name.endswith(".py") and not name.endswith("hatch_build.py")}
    scenes = {f"blender_bake/scenes/{name}.py" for name in SCENES}
    assert {name for name in names if ".dist-info/" not in name} == worker | scenes
    assert any(name.endswith(".dist-info/licenses/LICENSE") for name in names)


def test_licenses_are_named(srbf_built: Distribution, blender_built: Distribution) -> None:
    assert metadata(srbf_built.wheel)["License-Expression"] == "MIT"
    assert metadata(blender_built.wheel)["License-Expression"] == "GPL-3.0-or-later"
    assert (ROOT / "blender_bake" / "LICENSE").read_bytes() == (ROOT / "LICENSES" / "GPL-3.0-or-later.txt").read_bytes()


def test_the_long_description_has_no_link_that_leads_nowhere(srbf_built: Distribution) -> None:
    description = metadata(srbf_built.wheel).get_payload()
    assert isinstance(description, str) and description.lstrip().startswith("# srbf")
    assert re.findall(r"\]\((?!https?:)[^)]*\)", description) == []


def test_one_version_everywhere() -> None:
    package = json.loads((ROOT / "web" / "package.json").read_text(encoding="utf-8"))
    cited = re.search(r"^version: (\S+)$", (ROOT / "CITATION.cff").read_text(encoding="utf-8"), re.MULTILINE)
    assert cited is not None
    assert {BLENDER["version"], package["version"], cited[1]} == {srbf.__version__}
    assert f"srbf-blender=={srbf.__version__}" in PROJECT["optional-dependencies"]["blender"]
