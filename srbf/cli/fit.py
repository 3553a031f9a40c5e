"""`srbf fit`: a capture becomes an asset."""

from __future__ import annotations

import time
from functools import partial
from typing import Annotated, Any

import typer

from srbf.asset import MANIFEST, Asset
from srbf.capture import Capture
from srbf.cli.fit_parameters import (
    Basis,
    Budget,
    Centers,
    Clusters,
    Domain,
    Encoding,
    Maps,
    Method,
    Psnr,
    Ridge,
    Scalars,
    Spread,
    Weighting,
)
from srbf.cli.parameters import CaptureFolder, Dask, Force, Output
from srbf.cli.terminal import note, progress_bar
from srbf.compute.dask_client import Cluster, checked
from srbf.encode.row_blocks import fit_tiles
from srbf.errors import InputError
from srbf.evaluation.errors_by_role import TrainErrorAccumulator, evaluate
from srbf.fitting.options import encode, method_for, method_of, more_maps_than_lights, settings_of
from srbf.io.files import check_replaceable


def fit(
    capture: CaptureFolder,
    output: Output,
    method: Method = None,
    k: Maps = None,
    basis: Basis = None,
    centers: Centers = None,
    scalars: Scalars = None,
    clusters: Clusters = None,
    weighting: Weighting = None,
    domain: Domain = "auto",
    spread: Spread = "auto",
    ridge: Ridge = "auto",
    encoding: Encoding = None,
    budget: Budget = None,
    psnr: Psnr = None,
    dask: Dask = None,
    stitch: Annotated[
        bool, typer.Option("--stitch/--no-stitch", help="Make the two sides of UV seams agree, where the capture has any.")
    ] = True,
    force: Force = False,
) -> None:
    """Fit an asset to the train lights and measure its error on every role of the capture.

    Validation and holdout are measured on every texel. Train is measured on the images as they stream by, a sample of the texels where
    they are many: `srbf evaluate` reads them all again. With --dask other machines fit tiles of rows, and train is read once more here.
    """
    given: dict[str, Any] = {"k": k, "basis": basis, "centers": centers, "scalars": scalars, "clusters": clusters, "weighting": weighting}
    given |= {"encoding": encoding, "budget": budget, "psnr": psnr}
    kind = method_of(method, given)
    if dask is not None and kind != "relighting-map":
        raise InputError(f"expected --dask with --method relighting-map, whose tiles are independent, found it with {kind}")
    settings = settings_of(kind, given, domain, spread, ridge)
    check_replaceable(output, force, MANIFEST)
    opened = Capture.open(capture)
    started = time.perf_counter()
    chosen = method_for(opened, kind, settings, note)
    watch = None
    if dask is not None:
        with progress_bar("fit") as update, Cluster(checked(dask), note) as cluster:
            asset = encode(chosen, opened, update, stitched=stitch, tiles=partial(_tiles, cluster))
    else:
        watch = TrainErrorAccumulator(opened)
        with progress_bar("fit") as update:
            asset = encode(chosen, opened, update, watch.look, stitch)
    fitted = time.perf_counter()
    if (caution := more_maps_than_lights(chosen, opened)) is not None:
        note(caution)
    with progress_bar("evaluate") as update:
        errors = evaluate(asset, opened, update, watch=watch)
    asset.manifest["error"] = {role: error for role, error in errors.items() if role != "lights"}
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


def _tiles(cluster: Cluster, capture: Capture, lights: list[int], matrix: Any, ridge: float, progress: Any) -> Any:
    return fit_tiles(capture, lights, matrix, ridge, cluster.map, cluster.threads, progress)


def _summary(asset: Asset) -> str:
    facts = asset.manifest["source"]["fit"]
    chosen = f", chosen by {facts['chosen_by']}" if "chosen_by" in facts else ""
    size = f"{asset.bytes_per_texel()['directional']} bytes a texel"
    if asset.method != "relighting-map":
        clusters = f"{asset.clusters} clusters of " if asset.method == "clustered-eigen-map" else ""
        return f"{clusters}{asset.scalars} scalars ({size}{chosen})"
    condition = f"{facts['condition_number']:.3g}" if facts["condition_number"] is not None else "infinite"
    spread = f"spread {asset.basis.spread:.4g} rad, " if asset.manifest["basis"]["kind"] == "gaussian" else ""
    model = f"{spread}ridge {facts['ridge']:.3g}{chosen}"
    return f"{asset.k} maps ({size}; {model}; condition {condition}, rank {facts['rank']}, residual {facts['relative_residual']:.3g})"
