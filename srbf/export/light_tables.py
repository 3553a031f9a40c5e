"""The tables that an engine's CPU makes a frame's weights from, as one file of plain numbers, for code that reads no EXR."""

from __future__ import annotations

import struct

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32
from srbf.asset import Asset
from srbf.light_domain import Cloud, Named, domain_of_asset
from srbf.lights import NamedLight
from srbf.methods import method_of

MAGIC = b"SRBFTAB1"
NAMED, CLOUD = 0, 1
PLACES = 24  # of the cloud, over which the weights of no light in particular are the mean


def weights_shape(asset: Asset) -> tuple[int, int]:
    """(rows, columns) of the texture of weights: a row per cluster, the mean's weight first; of maps one row."""
    return (asset.clusters, asset.components + 1) if "scalars" in asset.manifest else (1, len(asset.stored))


def first_weights(asset: Asset) -> Float32[ndarray, "rows columns 3"]:
    """Weights before any light is set: all named lights as the scene has them; of a cloud, the mean of lights all over the free space."""
    domain, method = domain_of_asset(asset.manifest), method_of(asset)
    if isinstance(domain, Named):
        found = method.projected_weights(asset, [NamedLight(name) for name in domain.names])
    else:
        places = domain.probes(PLACES)
        found = np.mean([method.projected_weights(asset, [domain.light(place)]) for place in places], axis=0)
    return found.reshape(*weights_shape(asset), 3).astype(np.float32)


def table_file(asset: Asset) -> bytes:
    """Little-endian: MAGIC; int32 kind, rows, columns of the weights, F of them in all; then

    NAMED: int32 N; of every name int32 bytes and UTF-8; int32 whether there are values, float32 (F, N, 3): without, a weight is a light.
    CLOUD: float64 asset_from_world (4, 4), origin (3), spacing (m); int32 nodes (3), fine, rank R; float32 nodes (n, R), basis (R, F, 3);
    bytes of visibility. See `srbf.encode.position_table`.
    """
    rows, columns = weights_shape(asset)
    domain = domain_of_asset(asset.manifest)
    head = MAGIC + struct.pack("<iii", CLOUD if isinstance(domain, Cloud) else NAMED, rows, columns)
    if isinstance(domain, Named):
        names = [name.encode() for name in domain.names]
        listed = b"".join(struct.pack("<i", len(name)) + name for name in names)
        values = asset.tables.get("light_values")
        scaled = b"" if values is None else (values.astype(np.float32) * np.float32(asset.manifest["light_values"]["scale"])).tobytes()
        return head + struct.pack("<i", len(names)) + listed + struct.pack("<i", int(values is not None)) + scaled
    grid = asset.manifest["position_table"]
    placed = np.concatenate([asset.asset_from_world.ravel(), grid["origin"], [grid["spacing"]]]).astype("<f8").tobytes()
    counts = struct.pack("<5i", *grid["nodes"], grid["fine"], grid["rank"])
    tables = [asset.tables[name].astype("<f4").tobytes() for name in ("position_nodes", "position_basis")]
    return head + placed + counts + b"".join(tables) + asset.tables["position_visibility"].tobytes()
