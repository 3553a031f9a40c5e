"""Measurements on request of the page: the error of every light, and spectra, from a few thousand texels."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import cached_property
from threading import Lock

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64, Int
from srbf.asset import Asset
from srbf.capture import COVERED, Capture
from srbf.evaluation.errors_by_role import PEAK_QUANTILE, psnr, squared_errors
from srbf.evaluation.rate_distortion import singular_values, spectrum
from srbf.evaluation.temporal_stability import sampled_texels
from srbf.light_domain import domain_of_asset
from srbf.methods import captured_responses, method_of
from srbf.methods import responses as asset_responses
from srbf.viewer.references import compared_lights

DIRECTIONS = 192  # at which an asset is evaluated for its spectrum, enough for its number of functions


class Measures:
    """Measurements of assets of one scene, and of their capture if given; each is computed once, on first request."""

    def __init__(self, assets: Sequence[Asset], capture: Capture | None = None) -> None:
        self._assets = assets
        self._capture = capture
        self._lock = Lock()
        self._made: dict[tuple[str, int], bytes] = {}

    def errors(self, index: int) -> bytes:
        """JSON of asset `index` against every light that the page compares with: `rmse` and `psnr` (dB; of the peak of the train
        references) by light, and `texels`, the number of sampled texels. Both images are clamped at 0, except for indirect light."""
        return self._once("errors", index)

    def spectrum(self, index: int) -> bytes:
        """JSON of asset `index`: singular values, largest first, of its responses (`asset`) and of those of the capture (`capture`, or
        null), for the same texels and over the root of the number of responses; `scalars`: the asset's numbers per texel."""
        return self._once("spectrum", index)

    def _once(self, what: str, index: int) -> bytes:
        with self._lock:
            if (what, index) not in self._made:
                made = self._errors(index) if what == "errors" else self._spectrum(index)
                self._made[what, index] = json.dumps(made).encode()
            return self._made[what, index]

    @cached_property
    def _texels(self) -> Int[ndarray, " n"]:
        covered = self._assets[0].covered if self._capture is None else self._capture.coverage() >= COVERED
        return sampled_texels(covered)

    @cached_property
    def _sample(self) -> Capture:
        assert self._capture is not None
        return self._capture.load(self._texels)

    def _errors(self, index: int) -> dict[str, object]:
        sample, asset = self._sample, self._assets[index].at(self._texels)
        floor = -np.inf if sample.transport == "indirect" else 0.0
        every = compared_lights(sample)
        responses = sample.sample(sample.indices("train") or every, np.arange(len(self._texels)))
        peak = 1.0 if sample.source_bits == 8 else float(np.quantile(np.maximum(responses, 0), PEAK_QUANTILE))
        errors = []
        for first, block in sample.blocks(every):
            relit = captured_responses(asset, sample, every[first : first + len(block)])
            for response, true in zip(relit.reshape(block.shape), block, strict=True):
                errors.append(float(np.sqrt(squared_errors(response, true, floor)[0] / true.size)))
        return {"texels": len(self._texels), "peak": peak, "rmse": errors, "psnr": [psnr(peak, error) for error in errors]}

    def _spectrum(self, index: int) -> dict[str, object]:
        asset = self._assets[index].at(self._texels)
        responses = asset_responses(asset, domain_of_asset(asset.manifest).probes(DIRECTIONS))[:, 0]  # (b, n, 3)
        own = singular_values(responses.transpose(1, 0, 2).reshape(len(self._texels), -1)) / np.sqrt(responses.size)
        captured = None
        if self._capture is not None and (train := self._capture.indices("train")):
            captured = spectrum(self._sample) / np.sqrt(len(self._texels) * 3 * len(train))
        return {
            "scalars": method_of(asset).numbers_per_texel(asset),
            "asset": _listed(own),
            "capture": None if captured is None else _listed(captured),
        }


def _listed(values: Float64[ndarray, " r"]) -> list[float]:
    """All values above rounding errors, with six digits."""
    kept = values[values > 1e-5 * max(float(values[0]), 1e-30)]
    return [float(f"{value:.6g}") for value in kept]
