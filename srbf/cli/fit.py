"""`srbf fit`: a capture becomes an asset."""

from __future__ import annotations

import time
from typing import Annotated, Literal

import typer

from srbf.asset import MANIFEST
from srbf.capture import Capture
from srbf.cli.parameters import CaptureFolder, Force, Output, parse_spread
from srbf.cli.terminal import note, progress_bar
from srbf.evaluation import TrainWatch, evaluate
from srbf.files import check_replaceable
from srbf.methods.relighting_map import RelightingMap


def fit(
    capture: CaptureFolder,
    output: Output,
    k: Annotated[int, typer.Option("-k", help="How many maps.")] = 25,
    centers: Annotated[Literal["hammersley", "hammersley3", "fibonacci"], typer.Option(help="Point set of the basis.")] = "fibonacci",
    domain: Annotated[
        Literal["auto", "sphere", "hemisphere"], typer.Option(help="Where centers stand; auto: where the lights are.")
    ] = "auto",
    spread: Annotated[str, typer.Option(help="mean, min, or a number of radians.")] = "mean",
    ridge: Annotated[float, typer.Option(help="Added to the diagonal of the normal equations.")] = 0.0,
    encoding: Annotated[Literal["half", "float", "uint8"], typer.Option(help="Of the maps on disk.")] = "half",
    force: Force = False,
) -> None:
    """Fit k relighting maps by least squares and measure their error on every role of the capture.

    Validation and holdout are measured on every texel. Train is measured on the images as they stream by, a sample of the texels where
    they are many: `srbf evaluate` reads them all again.
    """
    method = RelightingMap(k=k, centers=centers, domain=domain, spread=parse_spread(spread), ridge=ridge, encoding=encoding)
    check_replaceable(output, force, MANIFEST)
    opened = Capture.open(capture)
    started = time.perf_counter()
    watch = TrainWatch(opened)
    with progress_bar("fit") as update:
        asset = method.encode(opened, update, watch.look)
    fitted = time.perf_counter()
    with progress_bar("evaluate") as update:
        errors = evaluate(asset, opened, update, watch)
    asset.manifest["error"] = {role: error for role, error in errors.items() if role != "lights"}
    asset.save(output, force)
    facts = asset.manifest["source"]["fit"]
    condition = f"{facts['condition_number']:.3g}" if facts["condition_number"] is not None else "infinite"
    note(
        f"fitted {k} maps to {facts['train_lights']} lights in {fitted - started:.1f} s: spread {asset.basis.spread:.4g} rad, "
        f"condition {condition}, rank {facts['rank']}, residual {facts['relative_residual']:.3g}"
    )
    for role, error in asset.manifest["error"].items():
        texels = f" (of {error['texels']} texels)" if "texels" in error else ""
        note(f"{role}: PSNR {error['psnr']:.2f} dB, relative RMSE {error['relative_rmse']:.4f}{texels}")
