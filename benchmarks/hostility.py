"""Hostile scenes against the bake command: each in a sandbox that must not change, with the pixels of a harmless twin."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from pathlib import Path

from faults import LostError

SCENE = Path(__file__).resolve().parent.parent / "data" / "scenes" / "hostile.py"
SMALL = ["--size", "8", "--lights", "4", "--samples", "2", "--validation", "0", "--holdout", "1", "--holdout-samples", "4"]

# Blender refuses these drivers when it saves the scene, and saves other values: alone they have no twin, together they do.
SAVED_OTHERWISE = {"object_driver", "shader_driver"}


def choices() -> list[tuple[str, ...]]:
    """Attempts per scene: all together, then each alone."""
    names = subprocess.run([sys.executable, str(SCENE), "list"], check=True, capture_output=True, text=True).stdout.split()
    return [(), *((name,) for name in names if name not in SAVED_OTHERWISE)]


def harmless_twin(place: Path) -> dict[str, bytes]:
    """The images of the scene without any attempt."""
    return _bake(place, ("none",))


def withstand(place: Path, chosen: tuple[str, ...], twin: dict[str, bytes]) -> None:
    """LostError if a scene with these attempts changes a file outside the capture, or a pixel."""
    if _bake(place, chosen) != twin:
        raise LostError(f"other pixels with {' '.join(chosen) or 'all attempts'}")


def _bake(place: Path, chosen: tuple[str, ...]) -> dict[str, bytes]:
    sandbox = place / "sandbox"
    for name in ("home", "temporary", "canaries"):
        (sandbox / name).mkdir(parents=True)
    scene = sandbox / "scene" / "hostile.blend"
    subprocess.run([sys.executable, str(SCENE), "build", str(scene), str(sandbox / "canaries"), *chosen], check=True, capture_output=True)
    before = snapshot(sandbox)
    line = [sys.executable, "-m", "srbf", "bake", str(scene), "-o", str(place / "capture"), "--receiver", "lightmap:Plane", *SMALL]
    environment = {**os.environ, "HOME": str(sandbox / "home"), "TMPDIR": str(sandbox / "temporary")}
    done = subprocess.run(line, capture_output=True, text=True, env=environment, timeout=120)
    if done.returncode:
        raise LostError(f"{chosen} ended as {done.returncode}: {done.stderr.strip()[-400:]!r}")
    if snapshot(sandbox) != before:
        raise LostError(f"{chosen} changed {sorted(dict(set(snapshot(sandbox).items()) ^ set(before.items())))}")
    return {str(path.relative_to(place)): path.read_bytes() for path in place.glob("capture/**/*.exr")}


def snapshot(folder: Path) -> dict[str, str]:
    """Every file by its checksum, every folder by its name."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else "folder"
        for path in sorted(folder.rglob("*"))
    }
