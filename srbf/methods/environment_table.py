"""Environment maps of a transfer asset without rays: what each cell of directions that the scene sees adds to the weights of shapes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.asset_reader import AssetReader
from srbf.compute.full_precision import by_channel
from srbf.errors import ManifestError
from srbf.lights import EnvironmentLight
from srbf.methods.light_table_maps import scaled_halves
from srbf.visibility.environment_cells import EnvironmentRows, cell_radiance

KEY = "environment_transfer"
FILES = {KEY: "environment_transfer.exr"}


def environment_columns(transfer: Float32[ndarray, "r S 3"], environment: EnvironmentRows) -> Float32[ndarray, "r K 3"]:
    """Weights of r shapes under radiance 1 in each of the K cells that surfels see, all bounces included."""
    columns = [(environment.matrix(c).T @ transfer[:, :, c].T)[environment.seen].T for c in range(3)]
    return np.pi * np.stack(columns, axis=2).astype(np.float32)


def add_environment_table(asset: Asset, columns: Float32[ndarray, "r K 3"], environment: EnvironmentRows) -> None:
    """The table and its key of the manifest: which cells, of a map of how many per side."""
    asset.tables[KEY], scale = scaled_halves(columns)
    asset.manifest[KEY] = {
        "file": FILES[KEY],
        "rank": len(columns),
        "side": environment.side,
        "cells": environment.seen.tolist(),
        "scale": scale,
    }


def read_environment_table(reader: AssetReader) -> dict[str, ndarray]:
    """The table of an asset on disk; none where it has none. ManifestError on cells that the map does not have."""
    if KEY not in reader.manifest:
        return {}
    told = reader.manifest[KEY]
    if max(told["cells"], default=0) >= told["side"] ** 2:
        raise ManifestError(
            f"expected cells below {told['side'] ** 2} of an environment in {reader.path}, found {max(told['cells'])}; fit again"
        )
    return {KEY: reader.table(KEY, (told["rank"], len(told["cells"])), 3).astype(np.float16)}


def has_environment_table(asset: Asset) -> bool:
    """Whether environment maps need no rays."""
    return KEY in asset.manifest


def environment_weights(asset: Asset, light: EnvironmentLight) -> Float64[ndarray, "r 3"]:
    """Weights of the shapes under an environment map, by one product of the table with the radiance in its cells."""
    told = asset.manifest[KEY]
    radiance = cell_radiance(light, told["side"])[told["cells"]].astype(np.float32)
    table = by_channel(asset.tables[KEY])
    return np.stack([table[c] @ radiance[:, c] for c in range(3)], axis=1).astype(np.float64) * told["scale"]


def without_environment_table(asset: Asset) -> Asset:
    """The asset without the table, so that environment maps are measured on its surfels like other lights.

    Examples
    --------
    >>> from srbf.methods.environment_table import without_environment_table
    >>> linear_response(without_environment_table(asset), [overcast])  # doctest: +SKIP
    """
    if not has_environment_table(asset):
        return asset
    manifest = {key: told for key, told in asset.manifest.items() if key != KEY}
    return replace(asset, manifest=manifest, tables={key: table for key, table in asset.tables.items() if key != KEY})
