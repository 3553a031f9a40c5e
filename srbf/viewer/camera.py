"""The camera of a view, estimated from its position map, since an asset does not record its camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float64
from srbf.asset import Asset

POINTS = 4000  # of the image, evenly spaced, for eleven unknowns
ROUNDS = 8  # of least squares; each leaves out the tenth with the largest residuals of the previous one: pixels across an edge
KEPT_SHARE = 0.9
MAX_RMS = 1.0  # pixels; beyond, the image has no pinhole camera
FLAT = 1e-6  # of the largest singular value; points in one plane do not determine the camera


@dataclass(frozen=True, eq=False)
class FittedCamera:
    """A pinhole camera: `position` (m), `rotation` whose rows are its right, down and forward axes, and `lens`, upper triangular with
    lens[2, 2] = 1, which takes camera coordinates to (u, v, 1) times depth; u right and v down, 0 to 1 over the picture."""

    position: Float64[ndarray, " 3"]
    rotation: Float64[ndarray, "3 3"]
    lens: Float64[ndarray, "3 3"]
    rms: float  # pixels


def fitted_camera(asset: Asset) -> FittedCamera | None:
    """The pinhole camera that best fits the positions of a view's covered pixels; None without positions, or if none fits.

    Direct linear transformation: u = (P1 x) / (P3 x), v = (P2 x) / (P3 x), multiplied out, with the last entry of P set to 1 for x
    relative to the points' center, which is in front of the camera; then P = lens · rotation · (1 | −position) by RQ decomposition.
    Ill-conditioned if all points lie in a plane: None.
    """
    if "position" not in asset.images:
        return None
    rows, columns = np.nonzero(asset.covered)
    chosen = np.arange(0, len(rows), max(1, len(rows) // POINTS))
    world_from_asset = np.linalg.inv(asset.asset_from_world)
    places = asset.images["position"][rows[chosen], columns[chosen]] @ world_from_asset[:3, :3].T + world_from_asset[:3, 3]
    seen = np.stack([(columns[chosen] + 0.5) / asset.width, (rows[chosen] + 0.5) / asset.height], axis=1)
    if len(places) < 12:
        return None
    middle = places.mean(axis=0)
    size = float(np.sqrt(((places - middle) ** 2).sum(axis=1).mean()))
    if not size > 0 or np.linalg.svd(places - middle, compute_uv=False)[2] <= FLAT * size * np.sqrt(len(places)):
        return None
    points = (places - middle) / size
    kept = np.arange(len(points))
    for _ in range(ROUNDS):
        matrix = _projection(points[kept], seen[kept])
        error = _error(matrix, points, seen, (asset.width, asset.height))
        kept = np.argsort(error)[: int(KEPT_SHARE * len(error))]
    rms = float(np.sqrt((error[kept] ** 2).mean()))
    return _decomposed(matrix, middle, size, rms) if rms <= MAX_RMS else None


def _projection(points: Float64[ndarray, "N 3"], seen: Float64[ndarray, "N 2"]) -> Float64[ndarray, "3 4"]:
    ones, zeros = np.ones((len(points), 1)), np.zeros((len(points), 4))
    x = np.hstack([points, ones])
    left = np.vstack([np.hstack([x, zeros, -seen[:, :1] * points]), np.hstack([zeros, x, -seen[:, 1:] * points])])
    solved = np.linalg.lstsq(left, np.concatenate([seen[:, 0], seen[:, 1]]), rcond=None)[0]
    return np.append(solved, 1.0).reshape(3, 4)


def _error(
    matrix: Float64[ndarray, "3 4"], points: Float64[ndarray, "N 3"], seen: Float64[ndarray, "N 2"], size: tuple[int, int]
) -> Float[ndarray, " N"]:
    projected = points @ matrix[:, :3].T + matrix[:, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        error = np.linalg.norm((projected[:, :2] / projected[:, 2:] - seen) * size, axis=1)
    return np.where(np.isfinite(error), error, np.inf)


def _decomposed(matrix: Float64[ndarray, "3 4"], middle: Float64[ndarray, " 3"], size: float, rms: float) -> FittedCamera | None:
    from scipy.linalg import rq

    turn = matrix[:, :3]
    if abs(np.linalg.det(turn)) < 1e-9:  # an orthographic camera has no position
        return None
    position = middle - size * np.linalg.solve(turn, matrix[:, 3])
    lens, rotation = rq(turn)
    signs = np.sign(np.diag(lens))
    lens, rotation = lens * signs, rotation * signs[:, None]  # a positive diagonal: right, down, forward
    if np.linalg.det(rotation) < 0:
        return None
    return FittedCamera(position, rotation, lens / lens[2, 2], rms)
