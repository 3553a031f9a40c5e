"""Loss and size of containers: `python benchmarks/containers.py CAPTURE…` fits three methods and exports each to every container.

Relit dB is against the fit in floats (`srbf.export.loss`), held-out dB that of `srbf evaluate` on the exported folder. GPU memory is that
of 1024² texels at the same bytes per texel, with the mip levels of one chart (a third more; clusters have none) and the clusters' index.
The tables of point lights are listed separately. `--time` also times the export of 25 maps of 1024², those of the first capture repeated.
`--edges` measures captures of several charts instead: seams, and four mip levels at the charts' edges. Exit status 1 if a target is missed.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy import ndarray
from scipy import ndimage

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.encode.quantization import quantize, round_together
from srbf.encode.uv_seams import Stitch
from srbf.evaluation.errors_by_role import PEAK_QUANTILE, evaluate, psnr
from srbf.export import Settings, export, rounding
from srbf.export.layers import byte_ranges, functions_of
from srbf.export.loss import relit_psnr
from srbf.export.mips import chart_gap, coverage_of, levels_without_bleeding, shares
from srbf.export.rounding import blocks_alone, blocks_together
from srbf.fitting.options import encode as fit
from srbf.io.containers import read_texture_array
from srbf.io.containers.blocks import decode, encode
from srbf.methods import responses
from srbf.methods.clustered_eigen_map import ClusteredEigenMap
from srbf.methods.eigen_map import EigenMap
from srbf.methods.relighting_map import RelightingMap
from srbf.stored_layers import LayerEncoding

MIB = 1 << 20
SIDE = 1024
MIPS = 4 / 3
METHODS = {
    "25 maps": RelightingMap(k=25, encoding="float"),
    "eigen map, 28 components": EigenMap(components=28, encoding="float"),
    "64 clusters of 8 components": ClusteredEigenMap(encoding="float"),
    "256 clusters of 12 components": ClusteredEigenMap(clusters=256, components=12, encoding="float"),
}
CONTAINERS = (("exr", "half"), ("png", "uint8"), ("dds", "bc7"), ("dds", "bc1"))
EDGE_LEVELS = 4
MIN_COVERAGE = 1e-6  # of a level's texel; smaller values are rounding errors
BAR_MIB, BAR_PSNR, CLUSTERED_BAR_MIB = 34.0, 38.0, 24.0


@dataclass(frozen=True)
class Row:
    """One container of one method; `gpu` its layers, MiB of SIDE² texels with mip levels, `table` the table of point lights, MiB."""

    psnr: float
    held_out: float
    rmse: float
    disk: float
    texel: float
    gpu: float
    table: float


def measure(asset: Asset, capture: Capture, target: str, encoding: LayerEncoding, folder: Path) -> Row:
    report = export(asset, target, folder, Settings(encoding, levels=1), force=True)
    exported = Asset.open(folder)
    error = evaluate(exported, capture, roles=("holdout",))["holdout"]
    layers = sum(path.stat().st_size for path in folder.iterdir() if path.name.startswith(("map", "plane", "cluster")))
    index = 1 if "cluster_index" in exported.tables else 0
    mips = 1.0 if index else MIPS
    table = exported.tables["w_table"].nbytes / 3 * 4 / MIB if "w_table" in exported.tables else 0.0
    gpu = ((report.bytes_per_texel - index) * mips + index) * SIDE * SIDE / MIB
    return Row(report.psnr, error["psnr"], error["rmse"], layers / MIB, report.bytes_per_texel, gpu, table)


def as_bytes(asset: Asset, stored: ndarray, scale: ndarray, bias: ndarray) -> float:
    """dB of the asset with other layer bytes."""
    return relit_psnr(asset, replace(asset, stored=stored, scale=scale, bias=bias))


def ways_to_blocks(asset: Asset) -> dict[str, float]:
    """dB of BC7 of maps by preprocessing, with and without error feedback between layers."""
    values, functions = asset.coefficients(), functions_of(asset)
    assert functions is not None
    height, width = values.shape[1:3]
    plain, together = quantize(values, "uint8"), byte_ranges(asset, values)

    def seen(blocks: ndarray, scale: ndarray, bias: ndarray) -> float:
        return as_bytes(asset, decode(blocks, "bc7", width, height)[..., :3], scale, bias)

    rounded = np.stack([encode(layer, "bc7") for layer in round_together(values, functions, *together)])
    found = {
        "bytes, each map separately": as_bytes(asset, *plain),
        "BC7 of those": seen(blocks_alone(values, *plain[1:], "bc7"), *plain[1:]),
        "BC7 of bytes rounded together": seen(rounded, *together),
    }
    passes = rounding.PASSES
    for count in (0, 1, 3):
        rounding.PASSES = count
        found[f"BC7 with error feedback, {count} more passes"] = seen(blocks_together(values, functions, *together, "bc7"), *together)
    rounding.PASSES = passes
    return found


def components_per_layer(asset: Asset) -> dict[str, float]:
    """dB of BC7 with four components per layer, as in assets, and with three and no alpha: a third more layers."""
    values = asset.coefficients()
    height, width = values.shape[1:3]
    stored, scale, bias = quantize(values, "uint8")
    scale[asset.scale == 0], bias[asset.scale == 0] = 0, 0
    planes = stored.transpose(0, 3, 1, 2).reshape(-1, height, width)[: asset.components]
    found = {}
    for channels in (4, 3):
        layers = np.zeros((-(-len(planes) // channels), height, width, channels), np.uint8)
        for i, plane in enumerate(planes):
            layers[i // channels, ..., i % channels] = plane
        decoded = decode(np.stack([encode(layer, "bc7") for layer in layers]), "bc7", width, height)[..., :channels]
        again = np.zeros_like(stored)
        for i in range(len(planes)):
            again[i // 4, ..., i % 4] = decoded[i // channels, ..., i % channels]
        found[f"{channels} components per layer, {len(layers)} bytes per texel"] = as_bytes(asset, again, scale, bias)
    return found


def tiled(asset: Asset) -> Asset:
    """The asset repeated to SIDE² texels."""
    times = (1, SIDE // asset.height, SIDE // asset.width, 1)
    images = {name: np.tile(image, times[1:3] + (1,) * (image.ndim - 2)) for name, image in asset.images.items()}
    manifest = {**asset.manifest, "width": SIDE, "height": SIDE, asset.layers_key: asset.layers}
    return replace(asset, manifest=manifest, stored=np.tile(asset.stored, times), images=images)


def at_the_edges(path: Path, folder: Path) -> None:
    """Print the difference across seams relative to the mean, and dB of each mip level against the filtered image: at edges, and inside."""
    capture = Capture.open(path)
    directions = capture.directions(capture.indices("train")[::7])
    stitch = Stitch.of(capture)
    for name, method in METHODS.items():
        asset = fit(method, capture)
        if "cluster_index" in asset.tables:
            continue
        coverage = coverage_of(asset)
        print(f"{path}, {name}: {chart_gap(coverage)} texels between charts, {levels_without_bleeding(asset)} levels by auto")
        full = responses(asset, directions)
        peak = float(np.quantile(np.maximum(full[:, asset.covered], 0), PEAK_QUANTILE))
        encodings: tuple[LayerEncoding, ...] = ("half", "uint8", "bc7")
        for encoding in encodings:
            export(asset, "dds", folder, Settings(encoding, levels=EDGE_LEVELS), force=True)
            exported = Asset.open(folder)
            texture = read_texture_array(folder / exported.layers[0]["file"])
            seen = []
            for level in range(EDGE_LEVELS):
                texels = texture.pixels(level)[..., : exported.scale.shape[1]].astype(np.float32) / (1 if encoding == "half" else 255)
                layers = texels * exported.scale[:, None, None] + exported.bias[:, None, None]
                relit = responses(as_level(exported, layers), directions)
                rows, columns = (shares(size, smaller).toarray() for size, smaller in zip(coverage.shape, layers.shape[1:3], strict=True))
                area = rows @ coverage @ columns.T
                true = np.einsum("ih,bhwc,jw->bijc", rows, full * coverage[..., None], columns, optimize=True)
                inside = area > MIN_COVERAGE * area.max()
                edge = inside & ~ndimage.binary_erosion(inside, np.ones((3, 3)))
                errors = (
                    np.sqrt(np.square(relit[:, chosen] - true[:, chosen] / area[chosen][:, None]).mean())
                    for chosen in (edge, inside & ~edge)
                )
                seen.append(" / ".join(f"{psnr(peak, error):.1f}" for error in errors))
            seam = ""
            if stitch is not None:
                mean = np.abs(responses(asset.at(np.flatnonzero(asset.covered)), directions)).mean()
                stitched = responses(exported.at(stitch.texels), directions)[:, 0].transpose(1, 0, 2)
                gap = stitch.difference(stitched.reshape(len(stitched), -1)) / mean
                seam = f"seams {gap:.4f}, unstitched {asset.manifest['seams']['before']:.4f}; "
            print(f"  {encoding}: {seam}edge / inside by level, dB: {', '.join(seen)}", flush=True)


def as_level(asset: Asset, layers: ndarray) -> Asset:
    """The asset with float layers of another size, to relight."""
    entries = [{**entry, "encoding": "float"} for entry in asset.layers]
    manifest = {**asset.manifest, "height": layers.shape[1], "width": layers.shape[2], asset.layers_key: entries}
    one = np.ones_like(asset.scale)
    return replace(asset, manifest=manifest, stored=layers, scale=one, bias=0 * one, images={})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("captures", nargs="+", type=Path)
    parser.add_argument("--time", action="store_true", help="time the export of 25 maps of 1024² as well")
    parser.add_argument("--edges", action="store_true", help="measure seams and mip levels at chart edges instead")
    arguments = parser.parse_args()
    scratch = Path(tempfile.mkdtemp(prefix="srbf-containers-"))
    try:
        if arguments.edges:
            for path in arguments.captures:
                at_the_edges(path, scratch / "asset")
            return
        missed = [line for i, path in enumerate(arguments.captures) for line in run(path, scratch, arguments.time and i == 0)]
    finally:
        shutil.rmtree(scratch)
    sys.exit("\n".join(missed) if missed else 0)


def run(path: Path, scratch: Path, timed: bool) -> list[str]:
    """Print a capture's table; returns the missed targets."""
    capture = Capture.open(path)
    print(f"\n{path}: {capture.width} x {capture.height} texels")
    print(
        "| method | container | relit dB | held-out dB | rmse | layers on disk, MiB | bytes per texel | GPU, MiB | point-light table, MiB |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    rows: dict[tuple[str, str], Row] = {}
    for name, method in METHODS.items():
        asset = fit(method, capture)
        for target, encoding in CONTAINERS:
            if encoding == "bc1" and asset.method != "relighting-map":
                continue
            row = rows[name, encoding] = measure(asset, capture, target, encoding, scratch / "asset")
            print(
                f"| {name} | {encoding} | {row.psnr:.1f} | {row.held_out:.2f} | {row.rmse:.5f} | {row.disk:.2f} | {row.texel:g} "
                f"| {row.gpu:.1f} | {row.table:.1f} |",
                flush=True,
            )
        for way, kept in (ways_to_blocks(asset) if asset.method == "relighting-map" else components_per_layer(asset)).items():
            print(f"  {name}: {way}: {kept:.2f} dB", flush=True)
        if timed and asset.method == "relighting-map":
            began, cpu = time.perf_counter(), time.process_time()
            report = export(tiled(asset), "ktx2", scratch / "large", Settings("bc7"), force=True)
            print(f"  25 maps of 1024² as KTX2 of BC7, {report.levels} levels, {report.layer_bytes / MIB:.1f} MiB: ", end="")
            print(f"{time.perf_counter() - began:.1f} s, {time.process_time() - cpu:.1f} s of CPU, {report.psnr:.2f} dB", flush=True)
    maps, half = rows["25 maps", "bc7"], rows["25 maps", "half"]
    clustered = rows["64 clusters of 8 components", "bc7"]
    missed = []
    if maps.gpu > BAR_MIB or maps.psnr < BAR_PSNR:
        missed.append(f"{path}: 25 maps as BC7: {maps.gpu:.1f} MiB, {maps.psnr:.1f} dB; the target is {BAR_MIB:g} MiB, {BAR_PSNR:g} dB")
    if clustered.gpu + clustered.table > CLUSTERED_BAR_MIB or clustered.rmse >= half.rmse:
        missed.append(f"{path}: clusters as BC7: {clustered.gpu + clustered.table:.1f} MiB, rmse {clustered.rmse:.5f} and {half.rmse:.5f}")
    return missed


if __name__ == "__main__":
    main()
