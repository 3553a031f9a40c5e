# SPDX-License-Identifier: GPL-3.0-or-later
"""A share of a receiver's texels: an image whose texel centers are every n-th one's of the whole image, by moved UVs or a moved camera."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

UV_LAYER = "srbf share"


@dataclass(frozen=True)
class Share:
    """Every `step`-th texel across and down, from column `x` and row `y` on, row 0 at the top.

    at_centers: a lightmap's first sample is at the center of its texel, not spread over a footprint that is `step` texels' wide.
    """

    step: int
    x: int
    y: int
    at_centers: bool = False

    @staticmethod
    def of(region: dict[str, Any]) -> Share:
        """From the host's JSON."""
        x, y = region["offset"]
        return Share(region["step"], x, y, region.get("at_centers", False))

    def of_image(self, image: np.ndarray) -> np.ndarray:
        """Its texels of an image (H, W, C)."""
        return image[self.y :: self.step, self.x :: self.step]

    def size(self, width: int, height: int) -> tuple[int, int]:
        """(width, height) of its image."""
        return -(-(width - self.x) // self.step), -(-(height - self.y) // self.step)

    def coordinates(self, uv: np.ndarray, width: int, height: int) -> np.ndarray:
        """UVs (N, 2) on its image, of those on a whole one: texel n j + x is at j, texels being counted from their centers."""
        w, h = self.size(width, height)
        column = (uv[:, 0] * width - 0.5 - self.x) / self.step
        row = ((1 - uv[:, 1]) * height - 0.5 - self.y) / self.step
        return np.stack([(column + 0.5) / w, 1 - (row + 0.5) / h], axis=1).astype(np.float32)
