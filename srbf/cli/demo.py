"""`srbf demo`: a scene of ours from bpy script to report."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from srbf.bake.run import Reporter
from srbf.cli.parameters import Output
from srbf.cli.terminal import note, progress_bar
from srbf.demo import run_demo


def demo(
    output: Output,
    scene: Annotated[Literal["caustics", "house"], typer.Option(help="A table with glass on it, or a room by daylight.")] = "caustics",
    lights: Annotated[int, typer.Option(help="Directions to bake.")] = 400,
) -> None:
    """Bake a scene, fit its maps, relight it by unseen directions and lamps, and write a report to look at."""
    with progress_bar(scene) as update:
        page = run_demo(scene, output, lights, Reporter(update, note), update)
    note(f"look at {page}")
    note(f"drag its lights: srbf view {page.parents[1] / 'asset'} {page.parents[1] / 'capture'}")
