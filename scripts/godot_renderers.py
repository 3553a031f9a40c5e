"""Godot in its chroot, on both renderers; importing this module puts the checkout and the modules of its tests on the path."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), *(str(ROOT / "tests" / folder) for folder in ("export", "web", "viewer"))]

RENDERERS = {
    "gl_compatibility": ["--rendering-method", "gl_compatibility", "--rendering-driver", "opengl3"],
    "forward_plus": ["--rendering-method", "forward_plus", "--rendering-driver", "vulkan"],
}
SECONDS = 300  # of one Godot


def run(folder: Path, chroot: Path, *arguments: str, display: bool = False) -> str:
    """Run Godot in the chroot on a project below its /tmp; returns its output."""
    inside = "/" + folder.relative_to(chroot).as_posix()
    screen = ["xvfb-run", "-a"] if display else []
    command = ["chroot", str(chroot), "env", "HOME=/tmp", *screen, "godot", "--audio-driver", "Dummy", "--path", inside, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=SECONDS)
    said = done.stdout + done.stderr
    if done.returncode or "SCRIPT ERROR" in said or "SHADER ERROR" in said:
        sys.exit(f"expected Godot to run {folder.name} {' '.join(arguments)}, found\n{said}")
    return said


def chroot_of_godot() -> Path:
    """The folder of Godot's chroot; exits where it is not made yet."""
    chroot = Path(os.environ.get("SRBF_GODOT_CHROOT", Path.home() / ".cache" / "srbf" / "godot")).resolve()
    if not (chroot / "srbf-ready").exists():
        sys.exit(f"expected a chroot with Godot at {chroot}, found none; scripts/godot-chroot makes it, or set SRBF_GODOT_CHROOT")
    return chroot


def say(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()
