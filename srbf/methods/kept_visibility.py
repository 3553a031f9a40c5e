"""Compressed depths in an asset: of the surfels that lights are measured by, and of the receivers, for shadows without rays.

Of each set the asset has a file of coefficients, of bases, of the ranges of the bases' bytes, and of every point's cluster.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Literal
from weakref import WeakKeyDictionary

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.asset_reader import AssetReader
from srbf.errors import InputError
from srbf.lights import Light
from srbf.visibility.cloud_lights import CloudLights
from srbf.visibility.embree import EmbreeTriangles, has_embree
from srbf.visibility.hemisphere_map import SIDE
from srbf.visibility.pca_visibility import PcaVisibility, pca_visibility
from srbf.visibility.received import ReceivedLight, starts_of
from srbf.visibility.surface_cells import Cells

PointSet = Literal["surfel_visibility", "receiver_visibility"]
SETS: tuple[PointSet, PointSet] = ("surfel_visibility", "receiver_visibility")
PARTS = {"coefficients": "png", "bases": "png", "ranges": "exr", "clusters": "png"}
FILES = {f"{kind}_{part}": f"{kind}_{part}.{suffix}" for kind in SETS for part, suffix in PARTS.items()}
NONE, PREFIX = "none", "pca:"
MOST_COEFFICIENTS = 256
VISIBILITY_HELP = "Compressed depths of the surfels, by so many coefficients, as pca:50; or none."
RECEIVER_VISIBILITY_HELP = "Depths of the receivers as well, for `--direct pca`."

_received: WeakKeyDictionary[Asset, ReceivedLight] = WeakKeyDictionary()


def coefficient_count(visibility: str) -> int:
    """How many coefficients `pca:COUNT` asks for; 0 for `none`. InputError on anything else."""
    count = visibility.removeprefix(PREFIX)
    if visibility == NONE:
        return 0
    if visibility.startswith(PREFIX) and count.isascii() and count.isdecimal() and 1 <= int(count) <= MOST_COEFFICIENTS:
        return int(count)
    raise InputError(f"expected `visibility` none or pca:COUNT with 1 to {MOST_COEFFICIENTS} coefficients, as pca:50, found {visibility!r}")


def check_visibility(visibility: str, receivers: bool) -> None:
    """InputError on settings that cannot be."""
    if not coefficient_count(visibility) and receivers:
        raise InputError("expected `visibility=pca:50`, or another number, with `receiver_visibility`, found none; add it")


def add_visibility(asset: Asset, inside: CloudLights, visibility: str, receivers: bool) -> None:
    """Depths at the cells of `inside`, and at the covered texels of the asset, by rays.

    InputError where the asset's receivers have no positions and normals.
    """
    count = coefficient_count(visibility)
    if not count:
        return
    cells = inside.cells
    _add(asset, "surfel_visibility", cells.places, cells.normals, inside.occluders, inside.free, count)
    if receivers:
        _add(asset, "receiver_visibility", *receiver_points(asset), inside.occluders, inside.free, count)


def receiver_points(asset: Asset) -> tuple[Float32[ndarray, "P 3"], Float32[ndarray, "P 3"]]:
    """(positions, normals) of the covered texels, row by row. InputError where the asset has none."""
    if missing := [name for name in ("position", "normal") if name not in asset.images]:
        raise InputError(f"expected the {' and '.join(missing)} of the receivers for `receiver_visibility`, found none; bake again")
    covered = asset.covered
    return asset.images["position"][covered], asset.images["normal"][covered]


def _add(
    asset: Asset,
    kind: PointSet,
    positions: Float32[ndarray, "P 3"],
    normals: Float32[ndarray, "P 3"],
    occluders: EmbreeTriangles,
    free: Float64[ndarray, "F 3"],
    count: int,
) -> None:
    made = pca_visibility(starts_of(positions, normals), normals, occluders, free, count)
    clusters, rows, depths = made.bases.shape
    tables = {
        "coefficients": made.coefficients,
        "bases": made.bases.reshape(clusters * rows, depths),
        "ranges": np.stack([made.low.ravel(), made.span.ravel()]),
        "clusters": made.clusters.astype(np.uint8)[None],
    }
    for part, table in tables.items():
        asset.tables[f"{kind}_{part}"] = table
        asset.manifest[f"{kind}_{part}"] = {"file": FILES[f"{kind}_{part}"]}
    asset.manifest[kind] = {"points": len(positions), "coefficients": count, "clusters": clusters, "side": SIDE, "far": made.far}


def read_visibility(reader: AssetReader) -> dict[str, ndarray]:
    """The tables of an asset on disk; none where it has none. ImageError where a file is not of the size that the manifest says."""
    tables: dict[str, ndarray] = {}
    for kind in SETS:
        if kind not in reader.manifest:
            continue
        told = reader.manifest[kind]
        rows = told["clusters"] * (told["coefficients"] + 1)
        shapes = {
            "coefficients": (told["points"], told["coefficients"]),
            "bases": (rows, told["side"] ** 2),
            "clusters": (1, told["points"]),
        }
        for part, shape in shapes.items():
            found = reader.table(f"{kind}_{part}", shape, 1)[:, :, 0]
            tables[f"{kind}_{part}"] = np.round(found * 255).astype(np.uint8)
        tables[f"{kind}_ranges"] = reader.table(f"{kind}_ranges", (2, rows), 1)[:, :, 0]
    return tables


def kept_visibility(asset: Asset, kind: PointSet, normals: Float32[ndarray, "P 3"]) -> PcaVisibility:
    """Of an asset that has it, at points with these normals."""
    told = asset.manifest[kind]
    tables = {part: asset.tables[f"{kind}_{part}"] for part in PARTS}
    rows = told["coefficients"] + 1
    low, span = tables["ranges"].reshape(2, told["clusters"], rows)
    bases = tables["bases"].reshape(told["clusters"], rows, -1)
    return PcaVisibility(normals, tables["clusters"][0].astype(np.int64), tables["coefficients"], bases, low, span, float(told["far"]))


def by_depths(asset: Asset) -> Asset:
    """The asset without its scene, so that lights are shadowed on its surfels by compressed depths, whether or not there are rays.

    Raises
    ------
    InputError
        Where it has none.

    Examples
    --------
    >>> from srbf.methods.kept_visibility import by_depths
    >>> linear_response(by_depths(asset), lights)  # doctest: +SKIP
    """
    if not has_depths(asset):
        raise InputError("expected an asset with compressed depths for `shadows=pca`, found none; fit with `visibility=pca:50`")
    return replace(asset, scene=None, manifest={key: told for key, told in asset.manifest.items() if key != "scene"})


def has_depths(asset: Asset) -> bool:
    """Whether light of any kind can be measured on the asset's surfels without rays."""
    return "surfel_visibility" in asset.manifest


def light_on_patches(asset: Asset) -> Callable[[Light], Float64[ndarray, "K 3"]]:
    """What gives the mean irradiance of a light on every patch: by rays, or without them by compressed depths."""
    if not has_depths(asset) or (asset.scene is not None and has_embree()):
        return CloudLights.of_asset(asset).on_patches
    if asset not in _received:
        cells = Cells.of_image(asset.tables["cells"])
        _received[asset] = ReceivedLight(cells, kept_visibility(asset, "surfel_visibility", cells.normals))
    return _received[asset].on_patches
