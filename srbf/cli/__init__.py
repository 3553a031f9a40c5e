"""The command line: one command a file; each parses, calls, prints."""

from __future__ import annotations

from typing import Annotated

import typer

import srbf
from srbf.cli import bake, demo, evaluate, export, fit, import_, info, mesh, relight, report, view
from srbf.cli.method_flags import FitCommand
from srbf.cli.terminal import Commands

app = typer.Typer(
    cls=Commands, no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, help=srbf.__doc__, rich_markup_mode=None
)


def _version(value: bool) -> None:
    if value:
        typer.echo(f"srbf {srbf.__version__}")
        raise typer.Exit


@app.callback()
def main(version: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")] = False) -> None:
    """Render a scene once under many lights, compress what it answers, relight it in real time."""


app.command("bake")(bake.bake)
app.command("import")(import_.import_capture)
app.command("fit", cls=FitCommand)(fit.fit)
app.command("relight")(relight.relight)
app.command("evaluate", cls=FitCommand)(evaluate.evaluate)
app.command("report")(report.report)
app.command("export")(export.export)
app.command("mesh")(mesh.mesh)
app.command("view")(view.view)
app.command("info")(info.info)
app.command("demo")(demo.demo)
