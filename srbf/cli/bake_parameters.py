"""Parameters of `srbf bake`, by panels of its help: scene, lights, quality, farm, safety."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from srbf.bake.shard import Shard
from srbf.cli.values import (
    AUTO_OR_ANGLE,
    AUTO_OR_COUNT,
    COUNT,
    COUNT_OR_NONE,
    POSITIVE,
    Parsed,
    Size,
    duration,
    parse_share,
    size,
)
from srbf.receiver_share import share_step

SCENE, LIGHTS, QUALITY, FARM, SAFETY = "Scene", "Lights", "Quality", "Farm", "Safety"

Scene = Annotated[Path, typer.Argument(metavar="SCENE", help="The .blend; it is not changed, and nothing in it runs.", show_default=False)]
SceneName = Annotated[
    str | None,
    typer.Option(
        "--scene",
        metavar="NAME",
        help="Which scene of the .blend; default: the one it was saved in.",
        show_default=False,
        rich_help_panel=SCENE,
    ),
]
Receivers = Annotated[
    list[str] | None,
    typer.Option(
        metavar="RECEIVER",
        help="lightmap:OBJECT, vertices:OBJECT, view[:CAMERA] or probes[:METERS], a grid in free space. Repeat it for more: lightmaps "
        "share an atlas, others go to OUTPUT/NAME.",
        show_default=False,
        rich_help_panel=SCENE,
    ),
]
Collections = Annotated[
    list[str] | None,
    typer.Option(metavar="NAME", help="Every renderable mesh of a collection into the atlas.", show_default=False, rich_help_panel=SCENE),
]
Separate = Annotated[bool, typer.Option("--separate", help="A lightmap each instead of one atlas, in OUTPUT/NAME.", rich_help_panel=SCENE)]
UvLayer = Annotated[
    str | None,
    typer.Option(metavar="NAME", help="UV layer of a lightmap; default: the active one.", show_default=False, rich_help_panel=SCENE),
]
UnwrapBy = Annotated[
    Literal["smart", "lightmap-pack", "keep"],
    typer.Option(help="How a UV layer is made where none fits; keep: refuse.", rich_help_panel=SCENE),
]
NoCastShadow = Annotated[
    list[str] | None,
    typer.Option(
        metavar="OBJECT",
        help="An object that light passes, such as the ceiling of a closed room. Repeats.",
        show_default=False,
        rich_help_panel=SCENE,
    ),
]
KeepSceneLights = Annotated[
    bool, typer.Option("--keep-scene-lights", help="The scene's own lights and world become ambient light.", rich_help_panel=SCENE)
]

Lights = Annotated[
    Any,
    typer.Option(
        metavar="auto|COUNT",
        parser=AUTO_OR_COUNT,
        help="Directions to fit (Hammersley), or lights of a cloud (400); auto: as many, and such a --share, as a probe of the scene "
        "finds best for --time-limit or --error.",
        show_default=False,
        rich_help_panel=LIGHTS,
    ),
]
DomainOfLights = Annotated[
    Literal["sphere", "hemisphere"] | None,
    typer.Option(
        help="Where the light comes from; hemisphere, the default: from above the ground.", show_default=False, rich_help_panel=LIGHTS
    ),
]
LightList = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="A .lp file of directions to fit, instead of --lights.", show_default=False, rich_help_panel=LIGHTS),
]
LightSet = Annotated[
    str | None,
    typer.Option(
        metavar="SET",
        help="Other lights than directions. named: the scene's own, each by itself. cloud: --lights point lights in its free space. "
        "patches: parts of its surfaces, for any light inside. "
        "surfels: light between its surfaces, by rays, for any light. "
        "gather: the same for a view, in detail. cubemap:SIDE: distant lights from 6 SIDE x SIDE directions, by rays. "
        "point:SPACING: point lights that fill a box, so many meters apart.",
        show_default=False,
        rich_help_panel=LIGHTS,
    ),
]
LightGroups = Annotated[
    list[str] | None,
    typer.Option(
        "--light-group",
        metavar="COLLECTION",
        help="named: the lights of a collection as one. Repeats.",
        show_default=False,
        rich_help_panel=LIGHTS,
    ),
]
PatchCount = Annotated[
    int | None,
    typer.Option("--patches", metavar="COUNT", parser=COUNT, help="patches: how many (512).", show_default=False, rich_help_panel=LIGHTS),
]
SurfelDensity = Annotated[
    float | None,
    typer.Option(
        "--surfels-per-m2",
        metavar="DENSITY",
        parser=POSITIVE,
        help="surfels: how many per square meter of surface, 10000 in all at most (5000 to 10000 in all, about 16 cm in size).",
        show_default=False,
        rich_help_panel=LIGHTS,
    ),
]
PoolSize = Annotated[
    int | None,
    typer.Option(
        "--pool",
        metavar="COUNT",
        parser=COUNT,
        help="gather: surfels of the whole scene that the view gathers from, at most 65536 (32768).",
        show_default=False,
        rich_help_panel=LIGHTS,
    ),
]
ViewClusterCount = Annotated[
    Any,
    typer.Option(
        "--view-clusters",
        metavar="auto|COUNT",
        parser=AUTO_OR_COUNT,
        help="gather: parts of the view that gather light, at most 65536; auto: one a pixel, at most 20000, with --gather 40000.",
        show_default=False,
        rich_help_panel=LIGHTS,
    ),
]
GatherCount = Annotated[
    int | None,
    typer.Option(
        "--gather",
        metavar="COUNT",
        parser=COUNT,
        help="gather: in place of a pool, so many gather samples of each part, 8 to 2000 (the paper's form, one bounce: 120).",
        show_default=False,
        rich_help_panel=LIGHTS,
    ),
]
OperatorOf = Annotated[
    Literal["rays", "cycles"],
    typer.Option(
        "--operator",
        help="surfels: what traces the light that they send: rays, or Cycles, one patch of surfels at a time (--light-set patches).",
        rich_help_panel=LIGHTS,
    ),
]
Sparse = Annotated[
    bool,
    typer.Option(
        "--sparse",
        help="cubemap: trace the elements that neighbors do not tell; the default from 16.8 million on.",
        rich_help_panel=LIGHTS,
    ),
]
Full = Annotated[bool, typer.Option("--full", help="cubemap: trace every element; the default for fewer.", rich_help_panel=LIGHTS)]
SparseBy = Annotated[
    Literal["neighbors", "l1"] | None,
    typer.Option(
        "--sparse-by",
        help="cubemap: what tells them. neighbors, the default: coarser receivers that agree; l1: sparse combinations of dense rows.",
        show_default=False,
        rich_help_panel=LIGHTS,
    ),
]
GridSpacing = Annotated[
    float | None,
    typer.Option(
        "--grid",
        metavar="METERS",
        parser=POSITIVE,
        help="cloud: point lights on a grid, so far apart, instead of blue noise.",
        show_default=False,
        rich_help_panel=LIGHTS,
    ),
]
LightBounds = Annotated[
    str | None,
    typer.Option(
        metavar="BOX",
        help="x0,y0,z0,x1,y1,z1 of lights inside the scene, m; default: all that renders.",
        show_default=False,
        rich_help_panel=LIGHTS,
    ),
]
SunAngle = Annotated[
    Any,
    typer.Option(
        metavar="RADIANS",
        parser=AUTO_OR_ANGLE,
        help="Angular diameter of the light; auto: the mean light spacing.",
        rich_help_panel=LIGHTS,
    ),
]
TransportOf = Annotated[
    Literal["combined", "indirect"] | None,
    typer.Option(
        help="All light, or all but the light's direct diffuse part. Default: combined, of gather indirect.",
        show_default=False,
        rich_help_panel=LIGHTS,
    ),
]
Gloss = Annotated[
    int | None,
    typer.Option(
        "--gloss",
        metavar="ORDER",
        parser=COUNT,
        help="For glossy surfaces, the radiance toward any viewer. cloud: as spherical harmonics of order 1 to 4 (3); cubemap: by so many "
        "terms of the BRDF's in-out factorization, 1 to 64 (4), without further rays.",
        show_default=False,
        rich_help_panel=LIGHTS,
    ),
]
ValidationLights = Annotated[
    int | None,
    typer.Option(
        metavar="COUNT",
        parser=COUNT_OR_NONE,
        help="Validation lights. Default: 16, of gather none.",
        show_default=False,
        rich_help_panel=LIGHTS,
    ),
]
HoldoutLights = Annotated[
    int,
    typer.Option(metavar="COUNT", parser=COUNT_OR_NONE, help="Held-out lights, for the reported error alone.", rich_help_panel=LIGHTS),
]

SizeOf = Annotated[
    Size | None,
    typer.Option(
        metavar="PIXELS",
        parser=size,
        help="Texels, WxH, or N for NxN. Default: 256x256; of a view, 256 on the longer side of its camera's frame.",
        show_default=False,
        rich_help_panel=QUALITY,
    ),
]
TexelsPerMeter = Annotated[
    float | None,
    typer.Option(
        metavar="NUMBER",
        parser=POSITIVE,
        help="Mean density of a lightmap, which decides its size.",
        show_default=False,
        rich_help_panel=QUALITY,
    ),
]
Samples = Annotated[
    Any,
    typer.Option(
        metavar="COUNT",
        parser=AUTO_OR_COUNT,
        help="Samples per texel of each fitted light; auto: until the error stops improving. Default 2, with --share or --lights auto 1, "
        "with --time-limit no limit.",
        show_default=False,
        rich_help_panel=QUALITY,
    ),
]
ShareOf = Annotated[
    int | None,
    typer.Option(
        "--share",
        metavar="FRACTION",
        parser=Parsed(share_step),
        help="Share of the texels that each fitted light renders: 1/4, 1/9 … 1/64; the next light renders others. Default whole.",
        show_default=False,
        rich_help_panel=QUALITY,
    ),
]
ErrorGoal = Annotated[
    float | None,
    typer.Option(
        "--error",
        metavar="ERROR",
        parser=Parsed(parse_share),
        help="With --lights auto: the relative RMSE at unseen lights to predict, as 8% or .08.",
        show_default=False,
        rich_help_panel=QUALITY,
    ),
]
TimeLimit = Annotated[
    Any,
    typer.Option(
        metavar="DURATION",
        parser=duration,
        help="Stop after so much time: 90s, 30m, 8h. The same command adds more samples.",
        show_default=False,
        rich_help_panel=QUALITY,
    ),
]
HoldoutSamples = Annotated[
    int,
    typer.Option(metavar="COUNT", parser=COUNT, help="Samples per texel of validation, holdout and ambient.", rich_help_panel=QUALITY),
]
Denoise = Annotated[bool, typer.Option("--denoise", help="Denoise a view's fitted images by OpenImageDenoise.", rich_help_panel=QUALITY)]
QuantityOf = Annotated[
    Literal["radiance", "irradiance"] | None,
    typer.Option(help="Default: irradiance of a lightmap, radiance of a view.", show_default=False, rich_help_panel=QUALITY),
]
Seed = Annotated[int, typer.Option(metavar="NUMBER", parser=COUNT_OR_NONE, help="Random seed.", rich_help_panel=QUALITY)]

Workers = Annotated[int, typer.Option(metavar="COUNT", parser=COUNT, help="Blender processes at a time.", rich_help_panel=FARM)]
LightsPerWorker = Annotated[
    int,
    typer.Option(metavar="COUNT", parser=COUNT, help="Lights after which a Blender process is replaced.", rich_help_panel=FARM),
]
WorkerTimeout = Annotated[
    float | None,
    typer.Option(
        metavar="SECONDS",
        parser=POSITIVE,
        help="Time after which a silent Blender is replaced; default: learned from the lights before.",
        show_default=False,
        rich_help_panel=FARM,
    ),
]
DaskScheduler = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Address of a dask scheduler, tcp://HOST:8786, whose workers render; they see the same folders.",
        show_default=False,
        rich_help_panel=FARM,
    ),
]
ShardOf = Annotated[
    Shard | None,
    typer.Option(
        metavar="I/N",
        parser=Parsed(Shard.parse),
        help="Bake all passes of the I-th of N shards alone, once `prepare` has been; a bake without it then finishes.",
        show_default=False,
        rich_help_panel=FARM,
    ),
]
FarmOf = Annotated[
    Literal["openjd"] | None,
    typer.Option(
        help="Bake nothing: write a render farm's job into -o, an Open Job Description bundle.",
        show_default=False,
        rich_help_panel=FARM,
    ),
]
FarmTasks = Annotated[
    int | None,
    typer.Option(
        metavar="COUNT",
        parser=COUNT,
        help="Tasks of the farm's bake; default: one for 32 lights.",
        show_default=False,
        rich_help_panel=FARM,
    ),
]

KeepAccumulation = Annotated[
    bool,
    typer.Option(
        "--keep-accumulation",
        help="Keep what --samples can later add to; --time-limit and --samples auto do.",
        rich_help_panel=SAFETY,
    ),
]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Print receiver, lights, disk and time; bake nothing.", rich_help_panel=SAFETY)]
Overwrite = Annotated[bool, typer.Option("--force", help="Replace an output that exists.", rich_help_panel=SAFETY)]
Restart = Annotated[
    bool, typer.Option("--restart", help="Drop a half-done capture of other settings and begin again.", rich_help_panel=SAFETY)
]
JsonProgress = Annotated[bool, typer.Option("--json-progress", help="Progress as JSON lines on stderr: done, total, what, seconds_left.")]
