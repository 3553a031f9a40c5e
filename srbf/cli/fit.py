"""`srbf fit`: a capture becomes an asset."""

from __future__ import annotations

import time
from functools import partial
from typing import Annotated, Any

import typer

from srbf.asset import MANIFEST, Asset
from srbf.capture import Capture
from srbf.cli.method_flags import FitCommand, with_method_flags
from srbf.cli.parameters import CaptureFolder, Dask, Force, Output
from srbf.cli.terminal import note, progress_bar
from srbf.compute.dask_client import Cluster, checked
from srbf.encode.row_blocks import fit_tiles
from srbf.evaluation.errors_by_role import TrainErrorAccumulator, evaluate
from srbf.evaluation.viewer_errors import viewer_errors, viewer_line
from srbf.fitting.denoising import Denoise
from srbf.fitting.options import encode, method_for
from srbf.io.files import check_replaceable
from srbf.methods import FitRun, method_of

COMMAND = FitCommand


@with_method_flags
def fit(
    capture: CaptureFolder,
    output: Output,
    method: str | None,
    settings: dict[str, Any],
    dask: Dask = None,
    stitch: Annotated[
        bool, typer.Option("--stitch/--no-stitch", help="Make the two sides of UV seams agree, where the capture has any.")
    ] = True,
    denoise: Annotated[
        Denoise,
        typer.Option(
            "--denoise", help="Filter the noise of few samples out of a lightmap's fitted images; auto: where validation lights gain."
        ),
    ] = "auto",
    force: Force = False,
) -> None:
    """Fit an asset to the train lights and measure its error on every role of the capture.

    Without flags: the best within 16 bytes per texel. -k N fits relighting maps, --components N an eigen map, --clusters N a clustered
    one; --budget, --psnr and --error choose among them.

    Validation and holdout are measured on every texel. Train is measured on the images as they stream by, a sample of the texels where
    they are many: `srbf evaluate` reads them all again. With --dask other machines fit blocks of rows, and train is read once more here.
    """
    check_replaceable(output, force, MANIFEST)
    opened = Capture.open(capture)
    started = time.perf_counter()
    chosen = method_for(opened, method, settings, note)
    watch = None
    if dask is not None:
        with progress_bar("fit") as update, Cluster(checked(dask), note) as cluster:
            asset = encode(chosen, opened, FitRun(update, solve_rows=partial(_solve_rows, cluster), say=note), stitch, denoise)
    else:
        watch = TrainErrorAccumulator(opened)
        with progress_bar("fit") as update:
            asset = encode(chosen, opened, FitRun(update, watch.look, say=note), stitch, denoise)
    fitted = time.perf_counter()
    if (caution := chosen.caution(opened)) is not None:
        note(caution)
    with progress_bar("evaluate") as update:
        errors = evaluate(asset, opened, update, watch=watch)
    asset.manifest["error"] = {role: error for role, error in errors.items() if role != "lights"}
    toward = viewer_errors(asset, opened) if "harmonics" in asset.manifest else {}
    asset.save(output, force)
    note(f"fitted {_summary(asset)} to {asset.manifest['source']['fit']['train_lights']} lights in {fitted - started:.1f} s")
    if "seams" in asset.manifest:
        seams = asset.manifest["seams"]
        note(
            f"seams: {seams['edges']} edges stitched, their difference {seams['before']:.4f} of the mean before, {seams['after']:.4f} after"
        )
    for role, error in asset.manifest["error"].items():
        texels = f" (of {error['texels']} texels)" if "texels" in error else ""
        note(f"{role}: PSNR {error['psnr']:.2f} dB, relative RMSE {error['relative_rmse']:.4f}{texels}")
    for role, error in toward.items():
        note(f"{role} lights toward random viewers: {viewer_line(error)}")


def _solve_rows(cluster: Cluster, capture: Capture, lights: list[int], matrix: Any, ridge: float, progress: Any) -> Any:
    return fit_tiles(capture, lights, matrix, ridge, cluster.map, cluster.threads, progress)


def _summary(asset: Asset) -> str:
    rule = asset.manifest["source"]["fit"].get("chosen_by")
    chosen = f"; spread and ridge chosen by {rule}" if rule else ""
    size = f"{asset.bytes_per_texel()['directional']} bytes per texel, {asset.resident_bytes() / 1e6:.1f} MB with tables and geometry"
    return f"{method_of(asset).summary(asset)} ({size}{chosen})"
