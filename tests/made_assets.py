"""Small assets made in memory for the tests of shaders, exports and engines; nothing in them is symmetric."""

from __future__ import annotations

from typing import Any

import numpy as np

from srbf.asset import Asset
from srbf.basis.gaussian import r_table, spread_of
from srbf.basis.light_functions import LightFunctions
from srbf.basis.neural_decoder import rows_of
from srbf.basis.octahedral_table import octahedral_table
from srbf.encode.quantization import quantize
from srbf.io.image import Encoding
from srbf.sphere import point_set

WIDEST = 1.0  # rad: wider tables break their own tolerance


def build_asset(
    k: int = 7,
    encoding: Encoding = "float",
    height: int = 9,
    width: int = 14,
    *,
    coefficients: np.ndarray | None = None,
    ambient: bool = False,
    position: bool = True,
    spread: float | None = None,
    seed: int = 0,
) -> Asset:
    """An asset of random signed maps over scattered receivers; nothing in it is symmetric."""
    rng = np.random.default_rng([seed, k])
    centers = point_set("fibonacci", k, "hemisphere")
    if spread is None:
        spread = min(spread_of(centers, "mean"), WIDEST) if k > 1 else 0.9
    if coefficients is None:
        coefficients = rng.normal(size=(k, height, width, 3)).astype(np.float32)
    stored, scale, bias = quantize(coefficients, encoding)
    images = {"coverage": (rng.random((height, width)) > 0.2).astype(np.float32)}
    if position:
        images["position"] = (rng.uniform(-1, 1, (height, width, 3)) * [1.3, 0.9, 0.2]).astype(np.float32)
    if ambient:
        images["ambient"] = rng.random((height, width, 3)).astype(np.float32)
    manifest: dict[str, Any] = {
        "method": "relighting-map",
        "width": width,
        "height": height,
        "domain": "hemisphere",
        "basis": {"kind": "gaussian", "centers": centers.tolist(), "spread": spread},
        "maps": [{"encoding": encoding} for _ in range(k)],
    }
    return Asset(manifest, stored, scale, bias, {"r_table": r_table(spread)}, images)


def build_planes(
    components: int = 9,
    clusters: int | None = None,
    encoding: Encoding = "float",
    height: int = 9,
    width: int = 14,
    *,
    ambient: bool = False,
    position: bool = True,
    patches: bool = False,
    seed: int = 0,
) -> Asset:
    """An asset of random coefficient maps with smooth random light functions; clusters are scattered, or in patches of 4 x 3 texels.

    None clusters is an eigen map, a number of them a clustered one.
    """
    rng = np.random.default_rng([seed, components, clusters or 0])
    count = (clusters or 1) * (components + 1)
    centers = point_set("fibonacci", 24, "sphere")
    coefficients = rng.normal(size=(count, len(centers), 3)).astype(np.float32)
    functions = LightFunctions(centers, rng.choice([0.5, 0.8], count), coefficients)
    table = octahedral_table(functions, "sphere", sizes=(17,))
    layers = np.zeros((-(-components // 4), height, width, 4), np.float32)
    for j in range(components):
        layers[j // 4, :, :, j % 4] = rng.normal(size=(height, width))
    stored, scale, bias = quantize(layers, encoding)
    scale[-1, components % 4 or 4 :], bias[-1, components % 4 or 4 :] = 0, 0
    images = {"coverage": (rng.random((height, width)) > 0.2).astype(np.float32)}
    if position:
        images["position"] = (rng.uniform(-1, 1, (height, width, 3)) * [1.3, 0.9, 0.2]).astype(np.float32)
    if ambient:
        images["ambient"] = rng.random((height, width, 3)).astype(np.float32)
    manifest: dict[str, Any] = {
        "method": "eigen-map" if clusters is None else "clustered-eigen-map",
        "width": width,
        "height": height,
        "domain": "sphere",
        "scalars": components,
        "light_basis": {"kind": "gaussian", "centers": centers.tolist(), "spreads": functions.spreads.tolist()},
        "w_table": {"size": table.size, "columns": table.columns},
        "planes": [{"encoding": encoding} for _ in layers],
    }
    tables = {"light_coefficients": coefficients, "w_table": table.atlas}
    if clusters is not None:
        manifest["clusters"] = clusters
        rows, columns = np.mgrid[:height, :width]
        spots = rows // 3 * (-(-width // 4)) + columns // 4 if patches else rng.permutation(height * width).reshape(height, width)
        tables["cluster_index"] = (spots * (clusters // 3 + 1) % clusters).astype(np.uint8)
        tables["cluster_index"][-1, -1] = clusters - 1
    return Asset(manifest, stored, scale, bias, tables, images)


def build_neural(codes: int = 9, hidden: int = 8, encoding: Encoding = "uint8", height: int = 9, width: int = 14, seed: int = 0) -> Asset:
    """A neural map of random codes and a random network, whose responses are of about unit size and bend with the direction."""
    rng = np.random.default_rng([seed, codes, hidden])
    layers = np.zeros((-(-codes // 4), height, width, 4), np.float32)
    for j in range(codes):
        layers[j // 4, :, :, j % 4] = rng.normal(size=(height, width))
    stored, scale, bias = quantize(layers, encoding)
    unused = range(codes % 4 or 4, 4)
    scale[-1, unused], bias[-1, unused] = 0, 0
    rows = rows_of(codes, hidden)
    network = (rng.normal(size=(rows, hidden)) * rng.uniform(0.5, 1.5, (rows, 1)) / np.sqrt(hidden)).astype(np.float32)
    network[codes : codes + 3] *= 3
    network[-1, 3:] = 0
    manifest: dict[str, Any] = {
        "method": "neural-map",
        "width": width,
        "height": height,
        "domain": "hemisphere",
        "quantity": "irradiance",
        "scalars": codes,
        "planes": [{"encoding": encoding} for _ in layers],
        "network": {"file": "network.exr", "hidden": hidden, "activation": "elu"},
    }
    positions = (rng.uniform(-1, 1, (height, width, 3)) * [1.3, 0.9, 0.2]).astype(np.float32)
    return Asset(
        manifest,
        stored,
        scale,
        bias,
        {"network": network},
        {"position": positions, "ambient": rng.random((height, width, 3)).astype(np.float32)},
    )
