"""The loss of an asset's relit pictures by another encoding."""

from __future__ import annotations

import numpy as np

from srbf.asset import Asset
from srbf.errors import InputError
from srbf.evaluation.errors_by_role import PEAK_QUANTILE, PeakHistogram, psnr, squared_errors
from srbf.light_domain import domain_of_asset
from srbf.methods import method_of

LIGHTS = 48  # of the domain: white and directional from Fibonacci points, mixes of names, or at free places of a cloud
AT_A_TIME = 8


def relit_psnr(asset: Asset, other: Asset) -> float:
    """PSNR (dB) of `other` relit against `asset` relit, the mean over LIGHTS lights of the domain.

    As DESIGN has it of captures: over covered texels, clamped at 0 (indirect responses unclamped), without ambient; the peak is the 99.9 %
    quantile of the asset's own pictures. MAX_PSNR where nothing differs.
    """
    covered = asset.covered
    if not covered.any():
        raise InputError("expected covered texels to measure the loss on, found coverage below one half everywhere; fit another capture")
    coordinates = domain_of_asset(asset.manifest).probes(LIGHTS)
    floor = -np.inf if asset.transport == "indirect" else 0.0
    peaks, squares = PeakHistogram(), []
    if not len(coordinates):
        raise InputError("expected free places in the asset to measure the loss on, found none; fit again")
    for start in range(0, len(coordinates), AT_A_TIME):
        some = coordinates[start : start + AT_A_TIME]
        references, responses = (method_of(one).responses(one, some) for one in (asset, other))  # in the asset's own frame
        for reference, response in zip(references, responses, strict=True):
            true = reference[covered]
            peaks.add(true)
            squares.append(squared_errors(response[covered], true, floor)[0])
    peak = peaks.quantile(PEAK_QUANTILE)
    samples = int(covered.sum()) * 3
    return float(np.mean([psnr(peak, float(np.sqrt(square / samples))) for square in squares]))
