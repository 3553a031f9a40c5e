"""From direct light on surfels to weights of shapes of light, as two small matrices: gather, then all exchanges of light among the shapes.

w_c = (1 + N_c) M rho_c e_c: rho is the albedo of the S surfels, M (r, S) takes radiosity to weights of the r shapes. 1 + N_c is the sum
over k of (M rho_c A)^k: what later reflections add, A what the shapes lay on the surfels. It is the transfer R_c (r, S) of each channel
in the space of the shapes, by a third of its numbers, and other albedo is another rho and N.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.asset_reader import AssetReader
from srbf.compute.full_precision import by_channel, channel_products, times_columns
from srbf.encode.table_steps import ROUNDING_NOISE, power_of_two
from srbf.methods.light_table_maps import pack_table, scaled_halves

TRANSFER = "surfel_transfer"  # sizes, and R itself in exports to engines and in older assets
GATHER, ALBEDO, SERIES = "surfel_gather", "surfel_albedo", "surfel_series"
FILES = {TRANSFER: "transfer.exr", **{name: f"{name}.exr" for name in (GATHER, ALBEDO, SERIES)}}
GATHER_ERROR = 0.03  # of what one surfel lays on the receivers, rms: more shows as blotches in a dim room next to the lit one
SERIES_ERROR = 0.005  # of pictures
MOST_STEPS = 1 << 14  # of the largest number of a row: finer ones are lost in half floats, and take a third byte
FAINT = 2.0**-12  # of the brightest surfel: fainter ones are rounded as much as one of that


def sizes_of(asset: Asset) -> tuple[int, int]:
    """(shapes, surfels)."""
    told = asset.manifest[TRANSFER]
    return int(told["rank"]), int(told["surfels"])


def has_series(asset: Asset) -> bool:
    """Whether the asset has the two matrices, not R alone."""
    return GATHER in asset.manifest


def add_surfel_tables(
    asset: Asset,
    gather: Float32[ndarray, "r S"],
    albedo: Float32[ndarray, "S 3"],
    series: Float32[ndarray, "r r 3"],
    shapes: Float32[ndarray, " r"],
) -> None:
    """M, rho and 1 + N, in steps that pictures do not show; `shapes`: the rms of each."""
    size = np.maximum(shapes, 1e-30)[:, None]
    column = np.sqrt(np.mean((gather * size) ** 2, axis=0))
    unit = power_of_two(np.maximum(column, FAINT * max(float(column.max(initial=0)), 1e-30)))
    step = power_of_two(np.float32(GATHER_ERROR / ROUNDING_NOISE) / size)
    asset.manifest[TRANSFER] = {"rank": len(gather), "surfels": gather.shape[1]}
    _store(asset, GATHER, (np.round(gather / unit / step) * step)[:, :, None])
    told = np.concatenate([albedo, (unit / unit.max())[:, None]], axis=1)
    asset.tables[ALBEDO] = told[None].astype(np.float16)
    asset.manifest[ALBEDO] = {"file": FILES[ALBEDO], "scale": float(unit.max())}
    set_series(asset, series, shapes)


def set_series(asset: Asset, series: Float32[ndarray, "r r 3"], shapes: Float32[ndarray, " r"] | None = None) -> None:
    """N of 1 + N, in steps by which pictures of shapes of those rms change by SERIES_ERROR; None: as it is, in a larger file."""
    later = series - np.eye(len(series), dtype=np.float32)[:, :, None]
    if shapes is not None:
        size = np.maximum(shapes, 1e-30)
        error = SERIES_ERROR * np.sqrt((size**2).sum()) / len(size)
        step = power_of_two(np.maximum(error / ROUNDING_NOISE / size, np.abs(later).max(axis=(1, 2)) / MOST_STEPS))[:, None, None]
        later = np.round(later / step) * step
    _store(asset, SERIES, later)


def set_albedo(asset: Asset, albedo: Float32[ndarray, "S 3"]) -> None:
    """rho, of surfels as they are."""
    asset.tables[ALBEDO] = np.concatenate([albedo[None], asset.tables[ALBEDO][:, :, 3:]], axis=2).astype(np.float16)


def weights_of_shapes(asset: Asset, irradiance: Float64[ndarray, "S ... 3"]) -> Float64[ndarray, "r ... 3"]:
    """What irradiance on the surfels, of one light or several, makes of the shapes, all bounces included."""
    received = irradiance.reshape(len(irradiance), -1, 3).astype(np.float32)  # (S, N, 3)
    if has_series(asset):
        reflected = (received * _reflectance(asset)[:, None]).reshape(len(received), -1)
        first = times_columns(by_channel(asset.tables[GATHER])[0], reflected) * np.float32(asset.manifest[GATHER]["scale"])
        first = first.reshape(len(first), -1, 3)
        later, scale = by_channel(asset.tables[SERIES]), np.float32(asset.manifest[SERIES]["scale"])
        weights = first + scale * channel_products(later.transpose(1, 2, 0), first)
    else:
        table, scale = by_channel(asset.tables[TRANSFER]), np.float32(asset.manifest[TRANSFER]["scale"])
        weights = scale * channel_products(table.transpose(1, 2, 0), received)
    return weights.astype(np.float64).reshape(len(weights), *irradiance.shape[1:])


def _reflectance(asset: Asset) -> Float32[ndarray, "S 3"]:
    """By what the columns of `surfel_gather` take irradiance: albedo times the unit of each."""
    *albedo, units = by_channel(asset.tables[ALBEDO])[:, 0]
    return np.stack(albedo, axis=1) * (units * np.float32(asset.manifest[ALBEDO]["scale"]))[:, None]


def gather_of(asset: Asset) -> Float32[ndarray, "r S"]:
    """M, from radiosity of the surfels to weights of the shapes."""
    units = by_channel(asset.tables[ALBEDO])[3, 0]
    scale = asset.manifest[GATHER]["scale"] * asset.manifest[ALBEDO]["scale"]
    return by_channel(asset.tables[GATHER])[0] * (units * np.float32(scale))


def albedo_of(asset: Asset) -> Float32[ndarray, "S 3"]:
    """rho."""
    return asset.tables[ALBEDO][0, :, :3].astype(np.float32)


def later_of(asset: Asset) -> Float32[ndarray, "3 r r"]:
    """N of each channel."""
    return by_channel(asset.tables[SERIES]) * np.float32(asset.manifest[SERIES]["scale"])


def with_transfer(asset: Asset) -> Asset:
    """The asset with R in place of the two matrices: one table fewer to multiply by, for shaders that know no other form."""
    if not has_series(asset):
        return asset
    gather, albedo = gather_of(asset), albedo_of(asset)
    reflected = [gather * albedo[:, c] for c in range(3)]
    table, scale = scaled_halves(np.stack([one + later @ one for one, later in zip(reflected, later_of(asset), strict=True)], axis=2))
    kept = {key: told for key, told in asset.manifest.items() if key not in (GATHER, ALBEDO, SERIES)}
    told = {"file": FILES[TRANSFER], **asset.manifest[TRANSFER], "scale": scale}
    tables = {name: own for name, own in asset.tables.items() if name not in (GATHER, ALBEDO, SERIES)}
    return replace(asset, manifest={**kept, TRANSFER: told}, tables={**tables, TRANSFER: table})


def read_surfel_tables(reader: AssetReader) -> dict[str, ndarray]:
    """The tables of an asset on disk."""
    told = reader.manifest[TRANSFER]
    rank, count = int(told["rank"]), int(told["surfels"])
    if GATHER not in reader.manifest:
        return {TRANSFER: reader.half_table(TRANSFER, (rank, count), 3)}
    return {
        GATHER: reader.half_table(GATHER, (rank, count), 1),
        ALBEDO: reader.table(ALBEDO, (1, count), 4).astype(np.float16),
        SERIES: reader.half_table(SERIES, (rank, rank), 3),
    }


def _store(asset: Asset, name: str, values: Float32[ndarray, "R N c"]) -> None:
    asset.tables[name], scale = scaled_halves(values)
    asset.manifest[name] = {"file": FILES[name], "scale": scale}
    pack_table(asset, name, "rows")
