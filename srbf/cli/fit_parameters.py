"""Parameters that choose a method and its settings: of `srbf fit`, and of an evaluation that fits anew for each light left out."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from srbf.fitting.options import DEFAULT_BUDGET, DEFAULT_METHOD

Method = Annotated[
    Literal["relighting-map", "eigen-map", "clustered-eigen-map", "auto"] | None,
    typer.Option(
        help=f"How light transport is compressed; auto: the best within --budget. Without it, by the other flags, else {DEFAULT_METHOD}.",
        show_default=False,
    ),
]
Maps = Annotated[int | None, typer.Option("-k", help="relighting-map: how many maps (25).", show_default=False)]
Basis = Annotated[
    Literal["gaussian", "spherical-harmonics", "hemispherical-harmonics", "ptm"] | None,
    typer.Option(help="relighting-map: Gaussians, or others as baselines.", show_default=False),
]
Centers = Annotated[
    Literal["auto", "hammersley", "hammersley3", "fibonacci"] | None,
    typer.Option(help="relighting-map: point set of the Gaussians; auto: fibonacci.", show_default=False),
]
Scalars = Annotated[int | None, typer.Option(help="eigen-map (28), clustered-eigen-map (8): numbers a texel.", show_default=False)]
Clusters = Annotated[int | None, typer.Option(help="clustered-eigen-map: how many, at most 256 (64).", show_default=False)]
Weighting = Annotated[
    Literal["plain", "relative"] | None,
    typer.Option(help="eigen-map: plain squared error, or relative to each texel's mean.", show_default=False),
]
Domain = Annotated[Literal["auto", "sphere", "hemisphere"], typer.Option(help="Where light can come from; auto: where the lights are.")]
Spread = Annotated[str, typer.Option(help="auto, a number of radians; relighting-map also mean or min.")]
Ridge = Annotated[str, typer.Option(help="auto, or what is added to the diagonal of the normal equations.")]
Encoding = Annotated[
    Literal["half", "float", "uint8"] | None, typer.Option(help="Of the maps on disk (half; auto: uint8).", show_default=False)
]
Budget = Annotated[int | None, typer.Option(help=f"auto: bytes a texel, at most ({DEFAULT_BUDGET}).", show_default=False)]
Psnr = Annotated[float | None, typer.Option(help="auto: dB to reach on unseen lights with the fewest bytes.", show_default=False)]
