"""Perceived difference of two linear images: HDR-FLIP, by NVIDIA's flip-evaluator if it is installed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32
from srbf.errors import MissingLibraryError

STOPS = (-2.0, 2.0)  # around `exposure`
EXPOSURES = 3
PPD = 67.0  # pixels per degree: a 0.7 m wide 4K screen seen from 0.7 m, the package's default


@dataclass(frozen=True)
class Flip:
    """HDR-FLIP at EXPOSURES exposures from STOPS[0] to STOPS[1] around `exposure` (EV), ACES tone mapping, PPD pixels per degree."""

    exposure: float

    def sentence(self) -> str:
        """The exposures and viewing conditions as a sentence."""
        low, high = (self.exposure + stop for stop in STOPS)
        return f"HDR-FLIP at {EXPOSURES} exposures {low:+.1f} to {high:+.1f} EV, ACES, {PPD:.0f} pixels per degree; 0 is equal, 1 maximal."

    def error_map(
        self, reference: Float32[ndarray, "H W 3"], test: Float32[ndarray, "H W 3"], covered: Bool[ndarray, "H W"]
    ) -> Float32[ndarray, "H W"]:
        """The largest error over the exposures, in [0, 1], of images clamped at 0; both are black outside `covered`.

        MissingLibraryError without flip-evaluator.
        """
        try:
            import flip_evaluator
        except ImportError as error:
            raise MissingLibraryError("HDR-FLIP needs flip-evaluator: pip install flip-evaluator") from error
        pictures = [np.ascontiguousarray(np.where(covered[..., None], np.maximum(p, 0), 0), np.float32) for p in (reference, test)]
        low, high = (self.exposure + stop for stop in STOPS)
        parameters = {"startExposure": low, "stopExposure": high, "numExposures": EXPOSURES, "ppd": PPD, "tonemapper": "aces"}
        errors, _, _ = flip_evaluator.evaluate(*pictures, "HDR", False, False, False, parameters)
        return np.asarray(errors, np.float32).reshape(covered.shape)
