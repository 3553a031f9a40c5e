"""`srbf relight`: an asset under lights becomes an image, or a folder of them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import typer

from srbf import methods
from srbf.asset import Asset
from srbf.cli.light_arguments import parse_directional, parse_point, parse_spot, read_environment, read_frames
from srbf.cli.parameters import AssetFolder, Force
from srbf.cli.terminal import note, progress_bar
from srbf.errors import InputError
from srbf.io.files import atomic_folder, check_replaceable
from srbf.io.image import write_image
from srbf.lights import Light
from srbf.methods import outside_domain
from srbf.relighting.alpha import Alpha, alpha_of, with_alpha, write_png
from srbf.relighting.direct_light import Added, chosen
from srbf.relighting.relighter import Relighter

FRAMES_MARKER = "0000.exr"


def relight(
    asset: AssetFolder,
    output: Annotated[Path, typer.Option("-o", "--output", help="OUT.exr, OUT.png, or with --lights a folder.", show_default=False)],
    directional: Annotated[list[str] | None, typer.Option(help="X,Y,Z[,R,G,B] towards the light. Repeats.", show_default=False)] = None,
    point: Annotated[list[str] | None, typer.Option(help="X,Y,Z[,R,G,B] position. Repeats.", show_default=False)] = None,
    spot: Annotated[list[str] | None, typer.Option(help="X,Y,Z,DX,DY,DZ,INNER,OUTER[,R,G,B]. Repeats.", show_default=False)] = None,
    environment: Annotated[list[Path] | None, typer.Option(help="Equirectangular image. Repeats.", show_default=False)] = None,
    a0: Annotated[float, typer.Option(help="Distance (m) at which a point or spot light has its color.")] = 1.0,
    falloff: Annotated[Literal["linear", "inverse-square"], typer.Option(help="Of point and spot lights.")] = "linear",
    lights: Annotated[Path | None, typer.Option(help="FRAMES.json: a folder of images, one a frame.", show_default=False)] = None,
    direct: Annotated[
        Literal["none", "ray", "shadow-map"] | None,
        typer.Option(help="Direct light added to an indirect asset; default: ray, without embreex shadow-map.", show_default=False),
    ] = None,
    renderer: Annotated[Literal["numpy", "gl"], typer.Option(help="Reference, or the shaders.")] = "numpy",
    exposure: Annotated[float, typer.Option(help="Stops, for PNG.")] = 0.0,
    alpha: Annotated[
        Alpha,
        typer.Option(
            help="Of views that do not fill their picture. straight: RGB whole at edges; premultiplied: RGB times alpha, as compositors "
            "expect of EXR; none: RGB alone, filled outside."
        ),
    ] = "straight",
    force: Force = False,
) -> None:
    """Relight by any number of lights at once: max(0, their sum) + ambient. EXR is linear float, PNG is sRGB.

    A view with an empty background gets its coverage as a fourth channel, A, and 0 where nothing is seen; lightmaps stay RGB.
    """
    if not abs(exposure) <= 100:
        raise InputError(f"expected an exposure within ±100 stops, found {exposure:g}")
    flags: list[Light] = [
        *map(parse_directional, directional or []),
        *(parse_point(text, a0, falloff) for text in point or []),
        *(parse_spot(text, a0, falloff) for text in spot or []),
        *map(read_environment, environment or []),
    ]
    if lights is not None:
        if flags:
            raise InputError("expected --lights FRAMES.json or light flags, found both; put all lights into the file")
        frames = read_frames(lights)
        opened = Asset.open(asset)
        opacity = alpha_of(opened)
        with (
            Added(opened, chosen(opened, direct)) as added,
            atomic_folder(output, force, FRAMES_MARKER) as folder,
            progress_bar("relight") as update,
        ):
            for number, frame in enumerate(frames):
                for line in outside_domain(opened, frame):
                    note(f"frame {number}: {line}")
            for number, image in enumerate(_render(opened, frames, renderer, added)):
                write_image(folder / f"{number:04d}.exr", with_alpha(image, opacity, alpha), "float")
                update(number + 1, len(frames))
            for line in added.notes([light for frame in frames for light in frame]):
                note(line)
        note(f"wrote {len(frames)} images into {output}")
        return
    if output.suffix.lower() not in (".exr", ".png"):
        raise InputError(f"expected an output named .exr or .png, found {output.name!r}")
    picture = output.suffix.lower() == ".png"
    if picture and alpha == "premultiplied":
        raise InputError("expected straight alpha for a PNG, whose format knows no other, found premultiplied; write an EXR")
    check_image_output(output, force)
    opened = Asset.open(asset)
    opacity = alpha_of(opened)
    for line in outside_domain(opened, flags):
        note(line)
    with Added(opened, chosen(opened, direct)) as added:
        (image,) = _render(opened, [flags], renderer, added)
        for line in added.notes(flags):
            note(line)
    if picture:
        write_png(output, image, None if alpha == "none" else opacity, exposure)
    else:
        write_image(output, with_alpha(image, opacity, alpha), "float")
    note(f"wrote {output}")


def check_image_output(path: Path, force: bool) -> None:
    """Refuse an image that exists, without --force."""
    if not (force and path.is_file()):
        check_replaceable(path, False, "")


def _render(asset: Asset, frames: list[list[Light]], renderer: str, added: Added) -> Iterator[np.ndarray]:
    if renderer == "numpy":
        yield from (methods.relight(asset, lights, added.response(lights)) for lights in frames)
    else:
        with Relighter(asset) as relighter:
            yield from (relighter.relight(lights, direct=added.response(lights)) for lights in frames)
