"""`srbf demo`: a scene of ours from bpy script to report."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from srbf.cli.parameters import Output
from srbf.cli.terminal import note, progress_bar
from srbf.cli.values import COUNT
from srbf.cli.view import serve

DIRECTIONS = 400


def demo(
    output: Output,
    scene: Annotated[
        Literal["caustics", "house", "loft"],
        typer.Option(help="A table with glass on it, a room by daylight, or a furnished loft with a light to carry through it."),
    ] = "caustics",
    lights: Annotated[
        int | None,
        typer.Option(metavar="COUNT", parser=COUNT, help="Directions to bake, by default 400; the loft needs none.", show_default=False),
    ] = None,
    quality: Annotated[
        Literal["draft", "publish"], typer.Option(help="publish: more texels, twice the samples, softer shadows; half an hour.")
    ] = "draft",
    view: Annotated[bool, typer.Option("--view", help="Open the viewer at the end; Ctrl-C ends it.")] = False,
) -> None:
    """Bake a scene, fit its maps, relight it by held-out lights, and write a report."""
    from srbf.bake.run import Reporter
    from srbf.demo import run_demo
    from srbf.demo.inside import INSIDE, run_demo_inside
    from srbf.viewer.contents import contents_of

    if scene in INSIDE and lights is not None:
        raise typer.BadParameter(f"expected --lights with a scene under directional lights, found it with {scene}; leave it out")
    with progress_bar(scene) as update:
        reporter = Reporter(update, note)
        if scene in INSIDE:
            made = run_demo_inside(scene, output, reporter, update, quality)
        else:
            made = run_demo(scene, output, DIRECTIONS if lights is None else lights, reporter, update, quality)
    note(f"look at {made.page}" + (f" and {made.picture}" if made.picture else ""))
    if view:
        serve(contents_of(made.assets, made.capture, made.mesh))
        return
    mesh = f" --mesh {made.mesh}" if made.mesh else ""
    note(f"move its lights: srbf view {' '.join(map(str, made.assets))} {made.capture}{mesh}")
