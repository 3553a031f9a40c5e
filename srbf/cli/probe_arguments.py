"""Places between probes as text: CSV in, CSV with the light there out."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.errors import InputError
from srbf.io import files

COLUMNS = ("x", "y", "z", "nx", "ny", "nz")
UNIT = 1e-3  # of a normal's length


def read_places(path: Path) -> tuple[Float64[ndarray, "n 3"], Float64[ndarray, "n 3"]]:
    """(points (m), unit normals) of a CSV of x,y,z,nx,ny,nz per line; a first line of words is skipped. InputError for anything else."""
    try:
        lines = [line for line in csv.reader(path.read_text(encoding="utf-8-sig").splitlines()) if line]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"expected places as CSV at {path}, found none to read: {error}") from None
    if lines and lines[0][0].strip().lower() == COLUMNS[0]:
        del lines[0]
    try:
        rows = np.array([[float(value) for value in line] for line in lines], np.float64)
    except ValueError:
        rows = np.zeros((0, 0))
    if rows.ndim != 2 or rows.shape[1:] != (len(COLUMNS),) or not np.isfinite(rows).all():
        raise InputError(f"expected lines of {','.join(COLUMNS)} in {path}, six numbers each, found others")
    lengths = np.linalg.norm(rows[:, 3:], axis=1)
    if (np.abs(lengths - 1) > UNIT).any():
        worst = int(np.abs(lengths - 1).argmax())
        raise InputError(f"expected unit normals in {path}, found one of length {lengths[worst]:.4g} at place {worst + 1}")
    return rows[:, :3], rows[:, 3:] / lengths[:, None]


def write_places(
    path: Path, points: Float64[ndarray, "n 3"], normals: Float64[ndarray, "n 3"], irradiance: Float32[ndarray, "n 3"]
) -> None:
    """The places with r,g,b, irradiance, behind them."""
    lines = [",".join((*COLUMNS, "r", "g", "b"))]
    lines += [",".join(f"{value:.7g}" for value in row) for row in np.concatenate([points, normals, irradiance], axis=1).tolist()]
    with files.atomic_path(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")
