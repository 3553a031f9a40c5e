"""`srbf demo`: a scene of ours from bpy script to report."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from srbf.cli.parameters import Output
from srbf.cli.terminal import note, progress_bar
from srbf.cli.values import COUNT
from srbf.cli.view import serve


def demo(
    output: Output,
    scene: Annotated[Literal["caustics", "house"], typer.Option(help="A table with glass on it, or a room by daylight.")] = "caustics",
    lights: Annotated[int, typer.Option(metavar="COUNT", parser=COUNT, help="Directions to bake.")] = 400,
    quality: Annotated[
        Literal["draft", "publish"], typer.Option(help="publish: more texels, twice the samples, softer shadows; half an hour.")
    ] = "draft",
    view: Annotated[bool, typer.Option("--view", help="Open the viewer at the end; Ctrl-C ends it.")] = False,
) -> None:
    """Bake a scene, fit its maps, relight it by held-out directions and point lights, and write a report."""
    from srbf.bake.run import Reporter
    from srbf.demo import run_demo
    from srbf.viewer.contents import contents_of

    with progress_bar(scene) as update:
        made = run_demo(scene, output, lights, Reporter(update, note), update, quality)
    note(f"look at {made.page}")
    if view:
        serve(contents_of(made.assets, made.capture, made.mesh))
        return
    mesh = f" --mesh {made.mesh}" if made.mesh else ""
    note(f"move its lights: srbf view {' '.join(map(str, made.assets))} {made.capture}{mesh}")
