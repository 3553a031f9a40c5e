"""Error of bounces of environment maps: an asset's table of cells against its capture's form factors, and against rays from surfels."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32
from srbf.asset import Asset
from srbf.capture import COVERED, Capture
from srbf.errors import InputError
from srbf.light_geometry import environment_samples
from srbf.lights import EnvironmentLight
from srbf.methods import linear_response
from srbf.methods.environment_table import has_environment_table, without_environment_table
from srbf.solve.radiosity import Bounces, reciprocal
from srbf.sphere import random_directions
from srbf.visibility.embree import has_embree
from srbf.visibility.environment_cells import cell_radiance
from srbf.visibility.transfer_operator import TransferOperator

ENVIRONMENTS = 8
BRIGHT, DIM = 1.0, 0.1  # radiance of the halves of an environment
MAP = (32, 64)


def random_environments(count: int = ENVIRONMENTS, seed: int = 0) -> list[EnvironmentLight]:
    """Environments with a bright half in a random direction."""
    directions, _ = environment_samples(np.zeros((*MAP, 3), np.float32), "sphere", np.eye(3))
    axes = random_directions(count, "sphere", np.random.default_rng(seed))
    halves = [np.where(directions @ axis > 0, np.float32(BRIGHT), np.float32(DIM)) for axis in axes]
    return [EnvironmentLight(np.repeat(half[..., None], 3, axis=2)) for half in halves]


def environment_errors(asset: Asset, capture: Capture, environments: int = ENVIRONMENTS, seed: int = 0) -> dict[str, Any]:
    """Relative RMSE of the bounces of random environments, half bright and half dim.

    Parameters
    ----------
    asset
        Of the method transfer, with a table of the environment.
    capture
        What it was fitted to: of surfels that see the environment.
    environments
        How many, at random directions.
    seed
        Of the directions.

    Returns
    -------
    dict
        `count`; `relative_rmse` over all and the `worst` one's, against the capture's form factors; where embreex is installed, `rays`,
        over all against rays from the asset's own surfels.

    Raises
    ------
    InputError
        Where asset or capture know no environment, or differ in size.

    Examples
    --------
    >>> environment_errors(asset, capture)["relative_rmse"]  # doctest: +SKIP
    0.03
    """
    operator = TransferOperator.read(capture.folder) if "surfels" in capture.manifest else None
    if operator is None or operator.environment is None or not has_environment_table(asset):
        raise InputError("expected an asset and a capture of surfels that see the environment, found others; bake and fit an open scene")
    if (asset.width, asset.height) != (capture.width, capture.height):
        raise InputError(f"expected a capture of the asset's {asset.width}x{asset.height} texels, found {capture.width}x{capture.height}")
    lights = random_environments(environments, seed)
    covered = (capture.coverage() >= COVERED).ravel()
    truth = _pictures(operator, capture, lights)[:, covered]
    found = _relit(asset, lights)[:, covered]
    errors, power = ((found - truth) ** 2).sum(axis=(1, 2)), np.maximum((truth**2).sum(axis=(1, 2)), 1e-30)
    result = {
        "count": environments,
        "relative_rmse": float(np.sqrt(errors.sum() / power.sum())),
        "worst": float(np.sqrt((errors / power).max())),
    }
    if has_embree():
        traced = _relit(without_environment_table(asset), lights)[:, covered]
        result["rays"] = float(np.sqrt(((found - traced) ** 2).sum() / max(float((traced**2).sum()), 1e-30)))
    return result


def _relit(asset: Asset, lights: list[EnvironmentLight]) -> Float32[ndarray, "n P 3"]:
    return np.stack([linear_response(asset, [light]).reshape(-1, 3) for light in lights])


def _pictures(operator: TransferOperator, capture: Capture, lights: list[EnvironmentLight]) -> Float32[ndarray, "n P 3"]:
    """The bounces of each environment by the form factors themselves, in the capture's quantity."""
    assert operator.environment is not None
    environment, cells = operator.environment, operator.cells
    received = np.stack([environment.irradiance(cell_radiance(light, environment.side)) for light in lights], axis=1).astype(
        np.float32
    )  # (S, n, 3)
    exchange, most = reciprocal(operator.exchange.toarray(), cells.areas), capture.manifest["surfels"].get("bounces")
    radiosity = [Bounces(exchange, cells.albedo[:, c].astype(np.float64), most).radiosity(received[:, :, c]) for c in range(3)]
    pictures = np.stack([(operator.receivers @ own).T for own in radiosity], axis=2)
    albedo = capture.geometry("albedo") if capture.quantity == "radiance" else None
    return pictures if albedo is None else pictures * (albedo.reshape(-1, 3) / np.float32(np.pi))
