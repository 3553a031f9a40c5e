"""`srbf export`: an asset in another form."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from srbf.asset import MANIFEST, Asset
from srbf.cli.parameters import AssetFolder, Force, Output
from srbf.cli.terminal import note
from srbf.files import check_replaceable
from srbf.reprojection import keep as keep_fewer


def export(
    asset: AssetFolder,
    output: Output,
    keep: Annotated[int, typer.Option(help="How many maps, or scalars of an eigen map, to project the asset on.", show_default=False)],
    encoding: Annotated[
        Literal["half", "float", "uint8"] | None,
        typer.Option(help="Of the maps; the asset's own unless given.", show_default=False),
    ] = None,
    force: Force = False,
) -> None:
    """Write an asset of fewer maps: quality for memory, without the capture."""
    check_replaceable(output, force, MANIFEST)
    kept = keep_fewer(Asset.open(asset), keep, encoding)
    kept.save(output, force)
    lost = kept.manifest["source"]["kept"].get("relative_residual")
    change = "" if lost is None else f", relative change {lost:.3g} over the domain"
    note(f"kept {keep} of {kept.manifest['source']['kept']['of']}: {kept.bytes_per_texel()['directional']} bytes a texel{change}")
