"""`srbf mesh`: a Blender scene as a binary glTF for the viewer and for engines."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from srbf.cli.parameters import Blender, Force, Json
from srbf.cli.terminal import note, print_json
from srbf.export.scene_mesh import write_scene_mesh


def mesh(
    scene: Annotated[
        Path, typer.Argument(metavar="SCENE", help="The .blend; it is not changed, and nothing in it runs.", show_default=False)
    ],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="The .glb to write.", show_default=False)],
    capture: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Of a lightmap: its receivers get the lightmap's UVs and its albedo.", show_default=False),
    ] = None,
    scene_name: Annotated[
        str | None,
        typer.Option(
            "--scene",
            metavar="NAME",
            help="Which scene of the .blend; default: the capture's, else the one it was saved in.",
            show_default=False,
        ),
    ] = None,
    blender: Blender = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Write all that renders of SCENE as one .glb: what lightmaps go onto, in its surroundings, for `--mesh`."""
    made = write_scene_mesh(scene, output, capture, blender, force, note, scene_name)
    if json:
        print_json(asdict(made))
        return
    lit = f", lightmap UVs on {', '.join(made.receivers)}" if made.receivers else ""
    note(f"wrote {output}: {made.objects} objects, {made.triangles} triangles, {made.materials} materials, {made.bytes} bytes{lit}")
