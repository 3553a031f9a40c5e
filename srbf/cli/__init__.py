"""The command line: one command a file, imported when it is called; each parses, calls, prints."""

from __future__ import annotations

from typing import Annotated

import typer

import srbf
from srbf.cli.group import Commands

COMMANDS = {  # where each is, and what the list of commands says of it
    "bake": ("srbf.cli.bake:bake", "Render a Blender scene under many lights: a capture."),
    "import": ("srbf.cli.import_:import_capture", "Make a capture of images and a light list."),
    "complete": ("srbf.cli.complete:complete", "Fill the texels that a capture's lights lack."),
    "fit": ("srbf.cli.fit:fit", "Compress a capture: an asset."),
    "relight": ("srbf.cli.relight:relight", "Light an asset by any number of lights: an image."),
    "evaluate": ("srbf.cli.evaluate:evaluate", "Print the error of an asset."),
    "report": ("srbf.cli.report:report", "Write a page about an asset: errors and figures."),
    "export": ("srbf.cli.export:export", "Write an asset as an engine loads it."),
    "mesh": ("srbf.cli.mesh:mesh", "Write a Blender scene as one .glb."),
    "view": ("srbf.cli.view:view", "Show an asset in the browser and move its lights."),
    "info": ("srbf.cli.info:info", "Print what a capture or an asset holds."),
    "demo": ("srbf.cli.demo:demo", "Bake and fit scenes that come with srbf, and write pages to relight them."),
}


class _Srbf(Commands):
    FUNCTIONS = {name: function for name, (function, _) in COMMANDS.items()}
    SUMMARIES = {name: summary for name, (_, summary) in COMMANDS.items()}


app = typer.Typer(cls=_Srbf, no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)


def _version(value: bool) -> None:
    if value:
        typer.echo(f"srbf {srbf.__version__}")
        raise typer.Exit


@app.callback()
def main(version: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")] = False) -> None:
    """Render a scene once under many lights, compress the results, relight it in real time."""
