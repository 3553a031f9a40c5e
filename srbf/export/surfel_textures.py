"""What an engine's own passes need to light surfels: cells of the surfaces as textures, what casts shadows, the asset's tables.

The textures are float EXRs beside the asset's own files, and the key `surfel_passes` of the exported asset.json says what they hold. The
tables are the asset's: a row of the file is a row of the table, so that entry i of row r is texel (i, r).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.asset import Asset
from srbf.errors import InputError
from srbf.io.image import write_image
from srbf.io.scene_glb import read_triangles
from srbf.methods.environment_table import KEY as ENVIRONMENT
from srbf.methods.surface_changes import KEY, Surfaces
from srbf.solve.radiosity import SERIES
from srbf.visibility.surface_cells import OFFSET, Cells

PASSES = "surfel_passes"
LARGEST = 16384  # texels per side of a texture, as Direct3D 11 has them
CORNERS_PER_ROW = 3 * 1024
MOST_TERMS = 512  # of a series without end, which engines sum by nine doublings: 0.99^512, what a surface still reflects then, is 0.6 %


@dataclass(frozen=True, eq=False)
class SurfelTextures:
    """Cells in the order of their patches, and corners of triangles, as rows of texels.

    `places`: place less `middle` (m), area (square meters); `normals`: unit normal, the cell's share of its patch's area; `ranges`: of
    every patch its first cell and how many there are; `corners` less `middle`, three texels per triangle. `reach` (m): what holds all
    of them, about the middle; `lift` (m): of a cell above its surface, where its shadow is looked up; `order`: the cells' numbers in
    the asset.
    """

    places: Float32[ndarray, "h w 4"]
    normals: Float32[ndarray, "h w 4"]
    ranges: Float32[ndarray, "a b 4"]
    corners: Float32[ndarray, "c d 3"]
    middle: Float64[ndarray, " 3"]
    reach: float
    lift: float
    patches: int
    triangles: int
    order: Int[ndarray, " N"]


def has_surfels(asset: Asset) -> bool:
    """Whether passes can measure lights on the asset's surfels."""
    return asset.scene is not None and asset.manifest.get("interpolation", {}).get("kind") in ("patches", "surfels")


def surfel_textures(asset: Asset) -> SurfelTextures:
    """Of an asset that `has_surfels`."""
    assert asset.scene is not None
    triangles = read_triangles(asset.scene)
    corners = triangles.corners[triangles.occluders].reshape(-1, 3).astype(np.float64)
    cells = Cells.of_image(asset.tables["cells"])
    count = cells.patch_count
    order = np.argsort(cells.patches, kind="stable")
    places = cells.places.astype(np.float64)
    middle = (places.min(axis=0) + places.max(axis=0)) / 2
    area = np.maximum(np.bincount(cells.patches, cells.areas.astype(np.float64), count), 1e-30)
    having = np.bincount(cells.patches, minlength=count)
    ranges = np.zeros((count, 4))
    ranges[:, 0], ranges[:, 1] = np.cumsum(having) - having, having
    share = cells.areas / area[cells.patches]
    farthest = max(float(np.linalg.norm(points - middle, axis=1).max(initial=0)) for points in (places, corners))
    return SurfelTextures(
        folded(np.column_stack([places - middle, cells.areas])[order]),
        folded(np.column_stack([cells.normals, share])[order]),
        folded(ranges),
        folded(corners - middle, CORNERS_PER_ROW),
        middle,
        farthest,
        OFFSET * float(np.ptp(cells.places, axis=0).max()),
        count,
        len(corners) // 3,
        order,
    )


def folded(values: ndarray, width: int | None = None) -> Float32[ndarray, "h w c"]:
    """Rows of values (n, c) as texels, 0 behind the last; about as high as wide without a `width`."""
    count = max(1, len(values))
    width = min(width or int(np.ceil(np.sqrt(count))), count)
    height = -(-count // width)
    out = np.zeros((height * width, values.shape[1]), np.float32)
    out[: len(values)] = values
    return out.reshape(height, width, -1)


def write_surfels(asset: Asset, folder: Path, data: str) -> dict[str, Any]:
    """Write the textures below `folder`/`data`; returns what `surfel_passes` of the manifest holds.

    `tables` take the mean irradiance of the patches, one after the other, to the asset's weights: `rows` of `columns` entries, times
    `scale`. `emission`: a row of weights per object, for a radiance of 1, to be added after the first table. `environment`: a table from
    radiance in `cells` to what is added there; `changes`: what other albedo needs. InputError where a table is larger than textures.
    """
    made = surfel_textures(asset)
    tables = [name for name in ("surfel_transfer", "light_values") if name in asset.tables]
    for table in tables:
        rows, columns = asset.tables[table].shape[:2]
        if max(rows, columns) > LARGEST:
            raise InputError(f"expected {table} of at most {LARGEST} rows and columns, found {rows} x {columns}; fit with fewer `clusters`")
    images = {"places": made.places, "normals": made.normals, "ranges": made.ranges, "corners": made.corners}
    if KEY in asset.manifest:
        surfaces = Surfaces.of(asset)
        images["emission"] = np.stack([surfaces.emitted(name, np.ones(3)) for name in surfaces.names]).astype(np.float32)
    if ENVIRONMENT in asset.manifest:
        images["cells"] = np.array(asset.manifest[ENVIRONMENT]["cells"], np.float32).reshape(-1, 1, 1)
    for name, pixels in images.items():
        write_image(folder / data / f"surfel_{name}.exr", pixels, "float")
    return {
        **({"environment": _matrix(asset, ENVIRONMENT, data) | {"side": asset.manifest[ENVIRONMENT]["side"]}} if "cells" in images else {}),
        **({"changes": _changes(asset, folder, data)} if "emission" in images else {}),
        **{name: f"{data}/surfel_{name}.exr" for name in images},
        **({"objects": list(Surfaces.of(asset).names)} if "emission" in images else {}),
        "middle": made.middle.tolist(),
        "reach": made.reach,
        "lift": made.lift,
        "patches": made.patches,
        "triangles": made.triangles,
        "tables": [_table(asset, name, data) for name in tables],
    }


def _changes(asset: Asset, folder: Path, data: str) -> dict[str, Any]:
    """`gather`, `sent`, `feedback` and `series`, the sum of all exchanges of light; `terms`: how many an engine sums after a change; of
    surfels `shares`, a row per object, and `albedo`; `first`: a row of weights per object that emits, without bounces.
    """
    surfaces = Surfaces.of(asset)
    write_image(folder / data / "surfel_series.exr", surfaces.series(), "float")
    write_image(folder / data / "surfel_first.exr", np.ascontiguousarray(surfaces.emission.transpose(1, 0, 2)), "float")
    write_image(folder / data / "surfel_shares.exr", surfaces.shares[..., None], "float")
    write_image(folder / data / "surfel_albedo.exr", surfaces.albedo[None], "float")
    own = {name: _matrix(asset, f"surface_{name}", data) for name in ("gather", "sent", "feedback")}
    files_ = {name: f"{data}/surfel_{name}.exr" for name in ("series", "first", "shares", "albedo")}
    return {**own, **files_, "terms": terms_of(surfaces)}


def terms_of(surfaces: Surfaces) -> int:
    """How many powers of the exchange of light an engine sums: the bounces of the bake, or so many that they stand for all.

    numpy solves an equation for an endless series. An engine has only products of matrices: by 2n terms = n terms + (exchange to the
    power n) times n terms, 512 cost 17 of them, and one of a few bounces fewer.
    """
    return MOST_TERMS if surfaces.bounces is None or surfaces.bounces >= SERIES else surfaces.bounces


def _matrix(asset: Asset, name: str, data: str) -> dict[str, Any]:
    """A file of the asset as rows of texels, values over `scale`."""
    told = asset.manifest[name]
    scale = told["scale"] if "scale" in told else asset.manifest[KEY]["scales"][name]
    return {"file": f"{data}/{told['file']}", "columns": asset.tables[name].shape[1], "scale": scale}


def _table(asset: Asset, name: str, data: str) -> dict[str, Any]:
    rows, columns, channels = asset.tables[name].shape
    told = asset.manifest[name]
    return {"file": f"{data}/{told['file']}", "rows": rows, "columns": columns, "channels": channels, "scale": told["scale"]}
