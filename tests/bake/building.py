"""Scenes of data/scenes, built by Blender when a test first asks for them."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).parents[2]
SCENES = ROOT / "data" / "scenes"


def built(script: str, folder: Path) -> Callable[[str], Path]:
    """The .blend of a named scene of a script of data/scenes, built when first asked for."""

    def build(name: str) -> Path:
        path = folder / f"{name}.blend"
        if not path.exists():
            subprocess.run([sys.executable, str(SCENES / script), name, str(path)], check=True, capture_output=True, timeout=120)
        return path

    return build
