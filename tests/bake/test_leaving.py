"""A worker that ends takes Blender's temporary folder with it, and no other."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

LEAVE = """
import sys, types
made = types.ModuleType("bpy")
made.app = types.SimpleNamespace(tempdir=sys.argv[1])
sys.modules["bpy"] = made
from blender_bake.ipc import leave
leave(3)
"""


@pytest.mark.parametrize(("name", "kept"), [("blender_a1B2c3", False), ("shared", True)])
def test_the_folder_of_the_session_is_removed(tmp_path: Path, name: str, kept: bool) -> None:
    folder = tmp_path / name
    folder.mkdir()
    (folder / "quit.blend").write_bytes(b"")
    assert subprocess.run([sys.executable, "-c", LEAVE, f"{folder}/"], timeout=60).returncode == 3
    assert folder.is_dir() == kept


def test_without_blender_it_ends_too() -> None:
    assert subprocess.run([sys.executable, "-c", "from blender_bake.ipc import leave; leave(0)"], timeout=60).returncode == 0
