"""The loss of an asset's relit pictures by another encoding."""

from __future__ import annotations

import numpy as np

from srbf.asset import Asset
from srbf.errors import InputError
from srbf.evaluation.errors_by_role import PEAK_QUANTILE, PeakHistogram, psnr, squared_errors
from srbf.light_domain import domain_of_asset
from srbf.methods import responses as asset_responses

LIGHTS = 48  # white, directional, from Fibonacci points of the domain
AT_A_TIME = 8


def relit_psnr(asset: Asset, other: Asset) -> float:
    """PSNR (dB) of `other` relit against `asset` relit, the mean over LIGHTS directions of the domain.

    As DESIGN has it of captures: over covered texels, clamped at 0 (indirect responses unclamped), without ambient; the peak is the 99.9 %
    quantile of the asset's own pictures. MAX_PSNR where nothing differs.
    """
    covered = asset.covered
    if not covered.any():
        raise InputError("expected covered texels to measure the loss on, found coverage below one half everywhere; fit another capture")
    coordinates = domain_of_asset(asset.manifest).probes(LIGHTS)
    floor = -np.inf if asset.transport == "indirect" else 0.0
    peaks, squares = PeakHistogram(), []
    for start in range(0, LIGHTS, AT_A_TIME):
        some = coordinates[start : start + AT_A_TIME]
        references, responses = asset_responses(asset, some), asset_responses(other, some)
        for reference, response in zip(references, responses, strict=True):
            true = reference[covered]
            peaks.add(true)
            squares.append(squared_errors(response[covered], true, floor)[0])
    peak = peaks.quantile(PEAK_QUANTILE)
    samples = int(covered.sum()) * 3
    return float(np.mean([psnr(peak, float(np.sqrt(square / samples))) for square in squares]))
