"""`srbf import`: photographs or renders with a light list become a capture."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from srbf.cli.parameters import Force, Output
from srbf.cli.terminal import note, progress_bar
from srbf.importing.photographs import LightListImport


def import_capture(
    lp: Annotated[Path, typer.Option("--lp", metavar="FILE", help="Light list: a count, then `name x y z` a line.", show_default=False)],
    output: Output,
    transfer: Annotated[
        Literal["srgb", "linear"], typer.Option(help="srgb: decode the curve; linear: stored values as they are.", show_default=False)
    ],
    holdout_lp: Annotated[
        Path | None, typer.Option("--holdout-lp", metavar="FILE", help="Light list of held-out images, not to fit.", show_default=False)
    ] = None,
    mask: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Image that becomes coverage: white is real.", show_default=False)
    ] = None,
    light_kind: Annotated[
        Literal["directional", "point"], typer.Option(help="Whether the lists hold directions, or positions in meters.")
    ] = "directional",
    quantity: Annotated[Literal["radiance", "irradiance"], typer.Option(help="What the images measure.")] = "radiance",
    layer: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Layer or part of multilayer EXR files, where several may be meant.", show_default=False),
    ] = None,
    images: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Folder of the images, where they are not beside the list.", show_default=False)
    ] = None,
    force: Force = False,
) -> None:
    """Pair images with the lights of a list by name, and write a capture."""
    with progress_bar("import") as update:
        manifest = LightListImport(lp, transfer, holdout_lp, mask, quantity, light_kind, layer, images).write(output, force, update, note)
    note(f"imported {len(manifest['lights'])} images of {manifest['width']}x{manifest['height']} into {output}")
