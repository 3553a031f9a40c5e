"""`srbf relight`: an asset under lights becomes an image, or a folder of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import typer

from srbf import methods
from srbf.asset import Asset
from srbf.bake.given_reference import MOST_SAMPLES, require_view
from srbf.cli.beside_cycles import compare, path_beside
from srbf.cli.flags import flags_alone
from srbf.cli.light_arguments import (
    parse_area,
    parse_directional,
    parse_named,
    parse_object,
    parse_point,
    parse_sphere,
    parse_spot,
    parse_viewer,
    read_environment,
    read_frames,
    with_falloff,
)
from srbf.cli.parameters import AssetFolder, Blender, Force
from srbf.cli.probe_arguments import read_places, write_places
from srbf.cli.terminal import note, progress_bar
from srbf.cli.values import POSITIVE, Number
from srbf.errors import InputError, MissingLibraryError
from srbf.io.files import atomic_folder, check_replaceable
from srbf.io.image import write_image
from srbf.light_domain import Named, domain_of_asset
from srbf.lights import Light, NamedLight
from srbf.methods import outside_domain
from srbf.methods.environment_table import without_environment_table
from srbf.methods.kept_visibility import by_depths
from srbf.methods.surface_changes import with_albedo
from srbf.relighting import probe_light
from srbf.relighting.alpha import Alpha, alpha_of, with_alpha, write_png
from srbf.relighting.direct_light import Added, Direct, chosen
from srbf.relighting.relighter import Relighter
from srbf.relighting.scene_lights import lines_of, profiles_of, scene_lights
from srbf.visibility.embree import has_embree

FRAMES_MARKER = "0000.exr"
REFERENCE_SAMPLES = 64  # of Cycles, unless told
BLACK = "the picture is black: no light reaches what it shows; check the lights' positions (m), directions and colors"
Viewer = tuple[float, float, float] | None
Shadows = Literal["ray", "pca"]


def relight(
    asset: AssetFolder,
    output: Annotated[
        Path,
        typer.Option(
            "-o", "--output", metavar="PATH", help="OUT.exr, OUT.png, with --lights a folder, with --at OUT.csv.", show_default=False
        ),
    ],
    directional: Annotated[
        list[str] | None, typer.Option(metavar="X,Y,Z[,R,G,B]", help="Towards the light, its color. Repeats.", show_default=False)
    ] = None,
    point: Annotated[
        list[str] | None, typer.Option(metavar="X,Y,Z[,R,G,B]", help="Position in meters, color. Repeats.", show_default=False)
    ] = None,
    spot: Annotated[
        list[str] | None,
        typer.Option(
            metavar="X,Y,Z,DX,DY,DZ,INNER,OUTER[,R,G,B]",
            help="Position, where it shines, half-angles in radians, color. Repeats.",
            show_default=False,
        ),
    ] = None,
    sphere: Annotated[
        list[str] | None, typer.Option(metavar="X,Y,Z,SIZE[,R,G,B]", help="Center, radius in meters, color. Repeats.", show_default=False)
    ] = None,
    area: Annotated[
        list[str] | None,
        typer.Option(
            metavar="X,Y,Z,UX,UY,UZ,VX,VY,VZ[,R,G,B]",
            help="Center, its sides U and V in meters, color; shines towards U x V. Repeats.",
            show_default=False,
        ),
    ] = None,
    light: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=INTENSITY[,R,G,B]", help="One of the scene's own lights: 1 is as it is set, 0 off. Repeats.", show_default=False
        ),
    ] = None,
    emissive: Annotated[
        list[str] | None,
        typer.Option(
            metavar="OBJECT=R,G,B",
            help="An object that emits this radiance, of an editable transfer asset. Repeats.",
            show_default=False,
        ),
    ] = None,
    albedo: Annotated[
        list[str] | None,
        typer.Option(
            metavar="OBJECT=R,G,B",
            help="An object's diffuse color in all bounces, of an editable transfer asset. Repeats.",
            show_default=False,
        ),
    ] = None,
    environment: Annotated[
        list[Path] | None, typer.Option(metavar="IMAGE", help="Equirectangular environment map. Repeats.", show_default=False)
    ] = None,
    turn: Annotated[
        float,
        typer.Option(
            metavar="RADIANS",
            parser=Number(low=-1e3, high=1e3),
            help="Of environment maps, about the vertical, counterclockwise seen from above.",
        ),
    ] = 0.0,
    reference_distance: Annotated[
        float, typer.Option(metavar="METERS", parser=POSITIVE, help="Distance a0 at which a light inside the scene has its color.")
    ] = 1.0,
    falloff: Annotated[
        Literal["linear", "inverse-square"] | None,
        typer.Option(
            help="Of point and spot lights; default: linear for assets of distant lights, else inverse-square. Of spheres inverse-square.",
            show_default=False,
        ),
    ] = None,
    lights: Annotated[Path | None, typer.Option(metavar="FRAMES.json", help="A folder of images, one a frame.", show_default=False)] = None,
    own_lights: Annotated[
        bool,
        typer.Option("--scene-lights", help="The lights of the scene that a deep framebuffer was baked from, as they are set there."),
    ] = False,
    fade: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS",
            parser=POSITIVE,
            help="With --lights, light cloud of the kernel: captured lights come and go over so long.",
            show_default=False,
        ),
    ] = None,
    fps: Annotated[float, typer.Option(metavar="N", parser=POSITIVE, help="With --fade: frames per second.")] = 24.0,
    ambient_only: Annotated[bool, typer.Option("--ambient-only", help="No light: the ambient light that the scene itself emits.")] = False,
    ambient: Annotated[
        bool, typer.Option("--ambient/--no-ambient", help="Add the ambient light that the scene itself emits, where the capture had any.")
    ] = True,
    direct: Annotated[
        Literal["none", "ray", "shadow-map", "pca"] | None,
        typer.Option(help="Direct light added to an indirect asset; default: ray, without embreex shadow-map.", show_default=False),
    ] = None,
    shadows: Annotated[
        Shadows | None,
        typer.Option(
            help="Of the light that bounces, on an asset's surfels: rays, or the depths of --visibility; default: ray, without embreex "
            "pca; of an environment neither where the asset knows the environment.",
            show_default=False,
        ),
    ] = None,
    viewer: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,Z",
            help="Where glossy surfaces are seen from, m; default: each from straight above itself.",
            show_default=False,
        ),
    ] = None,
    harmonics: Annotated[
        bool,
        typer.Option(
            "--harmonics",
            help="Of probes: nine spherical harmonics of the light that arrives, in columns harmonic X + x and rows z Y + y.",
        ),
    ] = False,
    at: Annotated[
        Path | None,
        typer.Option(
            metavar="PLACES.csv",
            help="Of probes: irradiance at places x,y,z,nx,ny,nz between them, m and unit normals, as a CSV.",
            show_default=False,
        ),
    ] = None,
    reference: Annotated[
        Path | None,
        typer.Option(
            metavar="SHOT.blend",
            help="Of a deep framebuffer: render the same lights by Cycles, too, into OUT_cycles.exr, and print the error and FLIP.",
            show_default=False,
        ),
    ] = None,
    samples: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            parser=Number(whole=True, low=1, high=MOST_SAMPLES),
            help="With --reference: of Cycles; default: 64.",
            show_default=False,
        ),
    ] = None,
    blender: Blender = None,
    renderer: Annotated[Literal["numpy", "gl"], typer.Option(help="Reference, or the shaders.")] = "numpy",
    exposure: Annotated[float, typer.Option(metavar="STOPS", parser=Number(low=-100, high=100), help="For PNG.")] = 0.0,
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
    with flags_alone():
        placed: list[Light] = [
            *map(parse_directional, directional or []),
            *(parse_point(text, reference_distance, falloff or "linear") for text in point or []),
            *(parse_spot(text, reference_distance, falloff or "linear") for text in spot or []),
            *(parse_sphere(text, reference_distance, falloff or "inverse-square") for text in sphere or []),
            *(parse_area(text, reference_distance) for text in area or []),
            *map(parse_named, light or []),
            *(NamedLight(*parse_object(text, "emissive")) for text in emissive or []),
        ]
        painted = dict(parse_object(text, "albedo", 1.0) for text in albedo or [])
        seen_from = None if viewer is None else parse_viewer(viewer)
    has_light = bool(placed or environment)
    if lights is not None and has_light:
        raise typer.BadParameter("expected --lights FRAMES.json or light flags, found both; put all lights into the file")
    if own_lights and (has_light or lights is not None or ambient_only):
        raise typer.BadParameter("expected --scene-lights without other lights, found both; leave one out")
    if ambient_only and (has_light or lights is not None):
        raise typer.BadParameter("expected --ambient-only without a light, found both; leave one out")
    if ambient_only and not ambient:
        raise typer.BadParameter("expected --ambient-only or --no-ambient, found both; leave one out")
    if not (has_light or ambient_only or own_lights or lights is not None):
        raise typer.BadParameter(
            "expected a light, found none; add --directional, --point, --spot, --sphere, --area, --light, --emissive, --environment, "
            "--scene-lights or --ambient-only"
        )
    if turn and not environment:
        raise typer.BadParameter("expected --environment with --turn, found none; add one, or give the turn in FRAMES.json")
    if reference is not None and (lights is not None or at is not None or harmonics or not ambient):
        raise typer.BadParameter("expected --reference without --lights, --at, --harmonics and --no-ambient, found both; leave one out")
    for flag, value in (("--samples", samples), ("--blender", blender)):
        if reference is None and value is not None:
            raise typer.BadParameter(f"expected --reference with {flag}, found none")
    if viewer is not None and renderer == "gl":
        raise typer.BadParameter("expected --renderer numpy with --viewer, found gl; leave it out")
    if fade is not None and (lights is None or renderer == "gl" or viewer is not None):
        raise typer.BadParameter("expected --fade with --lights, and without --viewer or --renderer gl, found another; leave it out")
    _check_probe_flags(output, harmonics, at, lights)
    picture = lights is None and output.suffix.lower() == ".png"
    if lights is None and at is None and output.suffix.lower() not in (".exr", ".png"):
        raise typer.BadParameter(f"expected an output named .exr or .png, found {output.name!r}")
    if picture and alpha == "premultiplied":
        raise typer.BadParameter("expected straight alpha for a PNG, whose format knows no other, found premultiplied; write an EXR")
    if lights is not None:
        opened = _opened(asset, painted, ambient)
        known = profiles_of(opened) if "scene_profiles" in opened.manifest else None
        frames = read_frames(lights, falloff or domain_of_asset(opened.manifest).falloff, known)
        _relight_frames(opened, output, frames, direct, renderer, alpha, force, seen_from, fade, 1 / fps, shadows, harmonics)
        return
    placed += (read_environment(path, turn) for path in environment or [])
    for written in [output] if reference is None else [output, path_beside(output)]:
        check_image_output(written, force)
    opened = _opened(asset, painted, ambient)
    if reference is not None:
        require_view(opened, reference)
    if own_lights:
        placed += scene_lights(opened).values()
        for line in lines_of(opened):
            note(line)
    if emissive:
        _check_emissive(opened)
    places = None if at is None else read_places(at)
    if harmonics or places is not None:
        probe_light.grid_of(opened)
    if falloff is None and not own_lights:
        placed = with_falloff(placed, domain_of_asset(opened.manifest).falloff)
    opacity = alpha_of(opened)
    for line in outside_domain(opened, placed):
        note(line)
    with Added(opened, chosen(opened, direct)) as added:
        (image,) = _render(_shadowed(opened, shadows), [placed], renderer, added, seen_from)
        for line in added.notes(placed):
            note(line)
    if placed and not image.any():
        note(BLACK)
    if places is not None:
        found = probe_light.light_at(opened, probe_light.harmonics(opened, image), *places)
        write_places(output, *places, found)
    elif harmonics:
        write_image(output, _atlas(opened, image), "float")
    elif picture:
        write_png(output, image, None if alpha == "none" else opacity, exposure)
    else:
        write_image(output, with_alpha(image, opacity, alpha), "float")
    note(f"wrote {output}")
    if reference is not None:
        compare(opened, image, placed, reference, REFERENCE_SAMPLES if samples is None else samples, output, blender, exposure)


def _relight_frames(
    opened: Asset,
    output: Path,
    frames: list[list[Light]],
    direct: Direct | None,
    renderer: str,
    alpha: Alpha,
    force: bool,
    viewer: Viewer,
    fade: float | None,
    seconds: float,
    shadows: Shadows | None,
    harmonics: bool,
) -> None:
    """An image of each frame's lights in the folder `output`."""
    opacity = alpha_of(opened)
    with (
        Added(opened, chosen(opened, direct)) as added,
        atomic_folder(output, force, FRAMES_MARKER) as folder,
        progress_bar("relight") as update,
    ):
        for number, frame in enumerate(frames):
            for line in outside_domain(opened, frame):
                note(f"frame {number}: {line}")
        drawn = _shadowed(opened, shadows)
        images = _render(drawn, frames, renderer, added, viewer) if fade is None else _faded(drawn, frames, added, fade, seconds)
        for number, image in enumerate(images):
            pixels = _atlas(opened, image) if harmonics else with_alpha(image, opacity, alpha)
            write_image(folder / f"{number:04d}.exr", pixels, "float")
            update(number + 1, len(frames))
        for line in added.notes([light for frame in frames for light in frame]):
            note(line)
    note(f"wrote {len(frames)} {'image' if len(frames) == 1 else 'images'} into {output}")


def _check_probe_flags(output: Path, harmonics: bool, at: Path | None, lights: Path | None) -> None:
    if at is not None and (harmonics or lights is not None):
        raise typer.BadParameter("expected --at without --harmonics and --lights, found both; leave one out")
    if at is not None and output.suffix.lower() != ".csv":
        raise typer.BadParameter(f"expected an output named .csv with --at, found {output.name!r}")
    if harmonics and lights is None and output.suffix.lower() != ".exr":
        raise typer.BadParameter(f"expected an output named .exr with --harmonics, which are signed, found {output.name!r}")


def _atlas(asset: Asset, image: np.ndarray) -> np.ndarray:
    return probe_light.grid_of(asset).image(probe_light.harmonics(asset, image))


def _opened(folder: Path, albedo: dict[str, tuple[float, float, float]], ambient: bool) -> Asset:
    opened = Asset.open(folder)
    if not ambient:
        opened = replace(opened, images={name: image for name, image in opened.images.items() if name != "ambient"})
    return with_albedo(opened, albedo) if albedo else opened


def _check_emissive(asset: Asset) -> None:
    """InputError where the asset has neither objects that emit nor lights by name."""
    if not (methods.method_of(asset).takes_objects or domain_of_asset(asset.manifest).kind == Named.kind):
        raise InputError(f"expected a transfer asset fitted with `editable` for `emissive` objects, found a {asset.method} one")


def _shadowed(asset: Asset, shadows: Shadows | None) -> Asset:
    """As its surfels are to be shadowed; MissingLibraryError for rays without embreex."""
    if shadows == "ray" and not has_embree():
        raise MissingLibraryError("rays from surfels need embreex: pip install embreex; or use `shadows=pca`")
    if shadows is not None:
        asset = without_environment_table(asset)
    return by_depths(asset) if shadows == "pca" else asset


def check_image_output(path: Path, force: bool) -> None:
    """Refuse an image that exists, without --force."""
    if not (force and path.is_file()):
        check_replaceable(path, False, "")


def _render(asset: Asset, frames: list[list[Light]], renderer: str, added: Added, viewer: Viewer) -> Iterator[np.ndarray]:
    if renderer == "numpy":
        yield from (methods.relight(asset, lights, added.response(lights), viewer) for lights in frames)
    else:
        with Relighter(asset) as relighter:
            yield from (relighter.relight(lights, direct=added.response(lights)) for lights in frames)


def _faded(asset: Asset, frames: list[list[Light]], added: Added, fade: float, seconds: float) -> Iterator[np.ndarray]:
    respond = methods.faded(asset, fade)
    for lights in frames:
        direct = added.response(lights)
        total = respond(lights, seconds)
        yield methods.finish(asset, total if direct is None else total + direct)
