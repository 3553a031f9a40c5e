"""`srbf demo`: scenes of ours from bpy script to a page on which they are relit."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from srbf.cli.parameters import Output
from srbf.cli.terminal import fail, note, progress_bar
from srbf.cli.values import COUNT
from srbf.cli.view import serve

if TYPE_CHECKING:
    from srbf.demo import Quality


def demo(
    output: Output,
    scene: Annotated[
        Literal["caustics", "coin", "house", "loft"] | None,
        typer.Option(
            help="One scene alone: a table with glass on it, a coin under a light dome, a room by daylight, or a furnished loft with a "
            "light to carry through it. By default loft, caustics and coin, with a page that has them all.",
            show_default=False,
        ),
    ] = None,
    lights: Annotated[
        int | None,
        typer.Option(
            metavar="COUNT",
            parser=COUNT,
            help="Directions to bake of caustics and house, by default 400, 144 with --transport indirect.",
            show_default=False,
        ),
    ] = None,
    transport: Annotated[
        Literal["combined", "indirect"],
        typer.Option(help="indirect: of caustics and house, direct light apart, which the page adds by shadow maps."),
    ] = "combined",
    quality: Annotated[
        Literal["draft", "publish"], typer.Option(help="publish: more texels, twice the samples, softer shadows; half an hour.")
    ] = "draft",
    view: Annotated[bool, typer.Option("--view", help="Open the page at the end; Ctrl-C ends the viewer of one scene.")] = False,
) -> None:
    """Bake scenes, fit their maps, relight them by held-out lights, and write a page of each that opens from disk."""
    from srbf.demo import SCENES

    for flag, given in (("--lights", lights is not None), ("--transport indirect", transport != "combined")):
        if given and scene not in SCENES:
            found = f"it with {scene}" if scene else "no --scene"
            raise typer.BadParameter(f"expected {flag} with a scene under directional lights, found {found}; leave it out")
    if scene is None:
        _tour(output, quality, view)
    else:
        _one(scene, output, lights, transport, quality, view)


def _tour(output: Path, quality: Quality, view: bool) -> None:
    from srbf.bake.run import Reporter
    from srbf.demo.tour import INDEX, run_tour

    with progress_bar("demo") as update:
        failures = run_tour(output, Reporter(update, note), update, quality)
    if view:
        import webbrowser

        webbrowser.open((output / INDEX).resolve().as_uri())
    if failures:
        fail(f"{'; '.join(failures)}; what could be made is in {output / INDEX}, and the same command tries again")
    note(f"open {output / INDEX}")


def _one(scene: str, output: Path, lights: int | None, transport: Literal["combined", "indirect"], quality: Quality, view: bool) -> None:
    from srbf.bake.run import Reporter
    from srbf.demo import demo_steps, finished
    from srbf.demo.dome import DOMES, dome_steps
    from srbf.demo.inside import INSIDE, inside_steps
    from srbf.viewer.contents import contents_of

    with progress_bar(scene) as update:
        reporter = Reporter(update, note)
        if scene in INSIDE:
            steps = inside_steps(scene, output, reporter, update, quality)
        elif scene in DOMES:
            steps = dome_steps(scene, output, reporter, update, quality)
        else:
            steps = demo_steps(scene, output, lights, reporter, update, quality, transport)
        made = finished(steps)
    note(f"look at {made.page}" + (f" and {made.picture}" if made.picture else ""))
    if view:
        serve(contents_of(made.assets, made.capture, made.mesh))
        return
    mesh = f" --mesh {made.mesh}" if made.mesh else ""
    note(f"move its lights: srbf view {' '.join(map(str, made.assets))} {made.capture}{mesh}")
