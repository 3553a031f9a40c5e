"""Fewer layers out of many, without the capture: the article's trade of quality for memory after the fit."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64
from srbf.asset import Asset
from srbf.basis.gaussian import GaussianBasis, r_table, spread_of
from srbf.encode.quantization import quantize, quantize_together
from srbf.io.image import Encoding
from srbf.sphere import all_around, point_set
from srbf.stored_layers import layer_entries

SPREADS = (0.8, 1.0, 1.25, 1.6, 2.0)  # of the mean distance between the new centers
WIDEST = 1.0  # rad: past it the R table has a cusp
REGULARIZATION = 1e-6  # of the Gram matrix's mean diagonal, added: Gaussians of geodesic distance can be all but dependent
CHANNELS = 4  # components to a layer


def fewer_maps(asset: Asset, manifest: dict[str, Any], count: int, encoding: Encoding) -> Asset:
    """Maps of `count` other Gaussians (Fibonacci centers) that come as near as they can over the domain.

    Gaussians are not orthogonal, so maps are not dropped. The sum of K Gaussians is projected: c' = G'^-1 H c with
    G'_ij = int R'_i R'_j and H_ij = int R'_i R_j, the spread the one that loses least. `manifest` is the new asset's, completed here.
    """
    directions = all_around(asset.domain)
    coefficients = asset.coefficients()
    flat = coefficients.reshape(asset.k, -1)
    before = asset.basis.evaluate(directions)
    energy = (flat @ flat.T).astype(np.float64)
    centers = point_set("fibonacci", count, asset.domain)
    best: tuple[float, GaussianBasis, Float64[ndarray, "k K"]] | None = None
    for factor in SPREADS:
        basis = GaussianBasis(centers, min(spread_of(centers, "mean") * factor, WIDEST))
        after = basis.evaluate(directions)
        gram = after.T @ after
        projection = np.linalg.solve(gram + REGULARIZATION * np.trace(gram) / count * np.eye(count), after.T @ before)
        residual: np.ndarray = before - after @ projection  # (M, K): of each old Gaussian
        lost = float(np.einsum("mi,ij,mj->", residual, energy, residual, optimize=True))
        if best is None or lost < best[0]:
            best = (lost, basis, projection)
    assert best is not None
    lost, basis, projection = best
    total = float(np.einsum("mi,ij,mj->", before, energy, before, optimize=True))
    kept = (projection.astype(np.float32) @ flat).reshape(count, *coefficients.shape[1:])
    stored, scale, bias = quantize_together(kept, basis.evaluate(directions)) if encoding == "uint8" else quantize(kept, encoding)
    table = r_table(basis.spread)
    manifest["maps"] = layer_entries("map", encoding, scale, bias)
    manifest["basis"] = {"kind": "gaussian", "centers": centers.tolist(), "spread": basis.spread}
    manifest["r_table"] = {"file": "r_table.exr", "size": len(table)}
    manifest["source"]["kept"]["relative_residual"] = float(np.sqrt(lost / total)) if total > 0 else 0.0
    return Asset(manifest, stored, scale, bias, {"r_table": table}, asset.images, asset.scene, asset.probes)


def fewer_components(asset: Asset, manifest: dict[str, Any], count: int, encoding: Encoding) -> Asset:
    """The first `count` components of an eigen map: they are orthogonal and in order. `manifest` is the new asset's, completed here."""
    images = -(-count // CHANNELS)
    layers = asset.coefficients()[:images].copy()
    unused = range(count % CHANNELS or CHANNELS, CHANNELS)
    layers[-1][..., unused] = 0
    stored, scale, bias = quantize(layers, encoding)
    scale[-1, unused], bias[-1, unused] = 0, 0
    size, columns = asset.manifest["w_table"]["size"], asset.manifest["w_table"]["columns"]
    rows = -(-(count + 1) // columns)  # whole rows of tiles
    table = asset.tables["w_table"][: rows * size]
    manifest["scalars"] = count
    manifest["planes"] = layer_entries("plane", encoding, scale, bias)
    manifest["light_basis"] = {**asset.manifest["light_basis"], "spreads": asset.manifest["light_basis"]["spreads"][: count + 1]}
    tables = {"light_coefficients": asset.tables["light_coefficients"][: count + 1], "w_table": table}
    return Asset(manifest, stored, scale, bias, tables, asset.images, asset.scene, asset.probes)
