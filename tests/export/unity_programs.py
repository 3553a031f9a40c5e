"""The engine-free C# of the Unity export, compiled by Mono."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

from srbf.export.engine_folder import engine_root

ENGINE_FREE = (
    "SrbfMath",
    "SrbfJson",
    "SrbfManifest",
    "SrbfImage",
    "SrbfDds",
    "SrbfLightTable",
    "SrbfPositionTable",
    "SrbfSurfels",
    "SrbfChanges",
)
Said = dict[str, list[list[float]]]


def compiled(program: Path) -> Callable[[Path, list[float]], Said]:
    """What the engine-free C# says of an exported folder and of lights as numbers, rows of numbers by name."""
    sources = [engine_root("unity") / "Srbf" / "Runtime" / f"{name}.cs" for name in ENGINE_FREE]
    done = subprocess.run(
        ["mcs", "-langversion:7", f"-out:{program}", *map(str, sources), str(Path(__file__).parent / "unity" / "Responses.cs")],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr

    def found(folder: Path, lights: list[float]) -> Said:
        done = subprocess.run(["mono", str(program), str(folder), *map(repr, lights)], capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, done.stderr
        if done.stdout.startswith("refused"):
            raise ValueError(done.stdout.strip())
        said: Said = {}
        for line in done.stdout.splitlines():
            name, *values = line.split()
            said.setdefault(name, []).append([float(value) for value in values])
        return said

    return found
