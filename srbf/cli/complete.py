"""`srbf complete`: a capture whose lights have a share of the texels becomes one of whole images."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from srbf.capture import Capture
from srbf.cli.parameters import Force, Output
from srbf.cli.terminal import note, progress_bar
from srbf.complete import complete as completed


def complete(
    capture: Annotated[
        Path, typer.Argument(metavar="CAPTURE", help="A capture whose lights have a share of the texels.", show_default=False)
    ],
    output: Output,
    force: Force = False,
) -> None:
    """Write CAPTURE with whole images, for programs that read no shares. srbf itself interpolates what it reads."""
    with progress_bar("complete") as update:
        count = completed(Capture.open(capture), output, force, update)
    note(f"completed {count} lights of {capture} into {output}")
