"""`srbf bake`: a Blender scene under many lights becomes a capture."""

from __future__ import annotations

from math import degrees
from pathlib import Path
from typing import Annotated, Literal

import typer

from srbf.bake.estimate import estimate
from srbf.bake.point_lights import PointGrid, survey
from srbf.bake.run import Bake, Reporter, base_job
from srbf.bake.settings import BakeSettings, Receiver
from srbf.cli.parameters import Blender, Force, Output, parse_size, parse_sun_angle
from srbf.cli.terminal import note, progress_bar
from srbf.errors import InputError


def bake(
    scene: Annotated[Path, typer.Argument(help="The .blend; it is not changed, and nothing in it runs.", show_default=False)],
    output: Output,
    receiver: Annotated[str, typer.Option(help="lightmap:OBJECT or view[:CAMERA].", show_default=False)],
    size: Annotated[str, typer.Option(help="Texels, N or WxH.")] = "256",
    lights: Annotated[int, typer.Option(help="Hammersley directions to fit.")] = 400,
    domain: Annotated[
        Literal["sphere", "hemisphere"], typer.Option(help="Where lights stand; hemisphere is above the ground.")
    ] = "hemisphere",
    samples: Annotated[int, typer.Option(help="Samples a texel of each fitted light.")] = 2,
    validation: Annotated[int, typer.Option(help="Random lights that decisions may look at.")] = 16,
    holdout: Annotated[int, typer.Option(help="Random lights for the reported error alone.")] = 32,
    holdout_samples: Annotated[int, typer.Option(help="Samples a texel of validation, holdout and ambient.")] = 64,
    quantity: Annotated[
        Literal["radiance", "irradiance"] | None,
        typer.Option(help="Default: irradiance of a lightmap, radiance of a view.", show_default=False),
    ] = None,
    transport: Annotated[
        Literal["combined", "indirect"], typer.Option(help="All light, or all but the sun's direct diffuse light.")
    ] = "combined",
    seed: Annotated[int, typer.Option(help="Of the noise and of the random lights.")] = 0,
    uv_layer: Annotated[str | None, typer.Option(help="UV layer of a lightmap; default: the active one.", show_default=False)] = None,
    light_list: Annotated[
        Path | None, typer.Option(help="A .lp file of directions to fit, instead of --lights.", show_default=False)
    ] = None,
    light_set: Annotated[
        str | None,
        typer.Option(help="point:SPACING: a box filled with lamps so many metres apart, instead of --lights.", show_default=False),
    ] = None,
    light_box: Annotated[
        str | None, typer.Option(help="x0,y0,z0,x1,y1,z1 of --light-set, m; default: all that renders.", show_default=False)
    ] = None,
    sun_angle: Annotated[
        str, typer.Option(help="Angular diameter of the light, rad; auto: as large as the fitted lights stand apart.")
    ] = "0",
    keep_lamps: Annotated[bool, typer.Option("--keep-lamps", help="The scene's own lamps and world become ambient.")] = False,
    blender: Blender = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say receiver, lights, disk and time; bake nothing.")] = False,
    force: Force = False,
    restart: Annotated[bool, typer.Option("--restart", help="Drop a half-done capture of other settings and begin anew.")] = False,
) -> None:
    """Bake SCENE under many lights, one at a time. Stopped at any moment, the same command goes on."""
    width, height = parse_size(size)
    parsed, angle = Receiver.parse(receiver, uv_layer), parse_sun_angle(sun_angle)
    settings = BakeSettings(
        receiver=parsed,
        width=width,
        height=height,
        lights=lights,
        domain=domain,
        samples=samples,
        validation=validation,
        holdout=holdout,
        holdout_samples=holdout_samples,
        quantity=quantity or ("irradiance" if parsed.kind == "lightmap" else "radiance"),
        seed=seed,
        sun_angle=0.0 if angle == "auto" else angle,
        keep_lamps=keep_lamps,
        light_list=light_list,
        transport=transport,
        points=None if light_set is None else PointGrid.parse(light_set, light_box),
    )
    if light_set is None and light_box is not None:
        raise InputError("expected --light-set point:SPACING with --light-box, found none")
    if angle == "auto":
        settings = settings.with_matched_sun()
        note(f"a sun of {settings.sun_angle:.4g} rad ({degrees(settings.sun_angle):.1f} degrees), as far as the fitted lights stand apart")
    if settings.points is not None:
        Bake(scene, output, settings, blender).check_scene()
        settings = survey(settings, base_job(scene, settings, output), blender, note)
    job = Bake(scene, output, settings, blender)
    if dry_run:
        for line in estimate(job, note):
            typer.echo(line)
        return
    with progress_bar("bake") as update:
        baked = job.run(Reporter(update, note), force, restart)
    note(f"baked {output}" if baked else f"{output} is complete already")
