"""Scenes of data/scenes and of tests/bake, built by Blender when a test first asks for one: all of a script at once, for all workers."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from filelock import FileLock

ROOT = Path(__file__).parents[2]
SCENES = ROOT / "data" / "scenes"
# By which surfaces are taken apart: every cell is tried from every free place, so that more of them cost more than a small bake.
FEW = {"visibility.patches.FEWEST_CELLS": 1000, "bake.light_sets.PLACES": 256}
FEW |= {"bake.light_sets.SURFEL_PLACES": 1024, "bake.light_sets.SURFELS": 2000, "bake.light_sets.FINGERPRINT_PATCHES": 128}
FEW |= {"visibility.transfer_operator.MOST_RAYS": 1024}  # of a receiver


def built(script: str, factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The .blend of a named scene of a script of data/scenes, which tests only read."""
    base = factory.getbasetemp()
    base = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    folder = base / f"scenes-{Path(script).stem}"
    done = folder / ".built"

    def build(name: str) -> Path:
        with FileLock(base / f"{folder.name}.lock"):
            if not done.exists():
                folder.mkdir(exist_ok=True)
                command = [sys.executable, str(Path(__file__).with_name("every_scene.py")), str(SCENES / script), str(folder)]
                subprocess.run(command, check=True, capture_output=True, timeout=120)
                done.touch()
        return folder / f"{name}.blend"

    return build
