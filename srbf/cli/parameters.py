"""Parameters that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Output = Annotated[Path, typer.Option("-o", "--output", metavar="FOLDER", help="Folder to write.", show_default=False)]
AssetFolder = Annotated[Path, typer.Argument(metavar="ASSET", help="Folder of an asset (asset.json).", show_default=False)]
CaptureFolder = Annotated[Path, typer.Argument(metavar="CAPTURE", help="Folder of a capture (capture.json).", show_default=False)]
Force = Annotated[bool, typer.Option("--force", help="Replace an output that exists.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout and nothing else.")]
Blender = Annotated[
    Path | None,
    typer.Option("--blender", metavar="PROGRAM", help="An installed Blender's executable, instead of the bpy module.", show_default=False),
]
Dask = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Address of a dask scheduler, tcp://HOST:8786, whose workers do the work; they see the same folders.",
        show_default=False,
    ),
]
