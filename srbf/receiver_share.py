"""A share of the receivers of an image: every n-th texel of every n-th row, so that a light costs a part of a whole image."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from srbf.errors import InputError, ManifestError

MOST_STEPS = 8  # texels from one to the next
Indexed = tuple[slice, slice]


@dataclass(frozen=True)
class Share:
    """Every `step`-th texel across and down, from column x and row y on, `offset` = (x, y) from the top left.

    Parameters
    ----------
    step
        2 to 8: 1 / step² of the texels.
    offset
        Column and row of the first one, each from 0 to step - 1.
    at_centers
        Of a request to the worker: the first sample of a lightmap's texel is at its center. Not kept in captures.

    Examples
    --------
    >>> import numpy as np
    >>> from srbf.receiver_share import Share
    >>> share = Share(2, (1, 0))
    >>> np.arange(12).reshape(3, 4)[share.indices].tolist()
    [[1, 3], [9, 11]]
    >>> share.size(4, 3)
    (2, 2)
    """

    step: int
    offset: tuple[int, int]
    at_centers: bool = False

    @staticmethod
    def of_manifest(entry: Mapping[str, Any], where: str) -> Share:
        """From a checked `share` of capture.json; ManifestError, naming the light as `where`, for an offset that is not below the step."""
        x, y = entry["offset"]
        if max(x, y) >= entry["step"]:
            raise ManifestError(f"expected an offset below the step {entry['step']} of the share of {where}, found {x}, {y}; bake again")
        return Share(entry["step"], (x, y))

    def json(self) -> dict[str, Any]:
        """As in capture.json, and in a request to the worker."""
        return {"step": self.step, "offset": list(self.offset), **({"at_centers": True} if self.at_centers else {})}

    @property
    def indices(self) -> Indexed:
        """What picks its texels of an array (H, W, ...)."""
        return slice(self.offset[1], None, self.step), slice(self.offset[0], None, self.step)

    def size(self, width: int, height: int) -> tuple[int, int]:
        """(width, height) of its image, of a whole image of so many texels."""
        return -(-(width - self.offset[0]) // self.step), -(-(height - self.offset[1]) // self.step)


def share_step(text: str) -> int:
    """The step of `whole`, or of a fraction 1/n² as 1/4, 1/9 or 1/16; InputError for others."""
    if text in ("whole", "1"):
        return 1
    found = re.fullmatch(r"1/([0-9]{1,3})", text)
    step = round(int(found[1]) ** 0.5) if found else 0
    if found is None or not 2 <= step <= MOST_STEPS or step**2 != int(found[1]):
        raise InputError(f"expected a share of whole, 1/4, 1/9, 1/16 or another square to 1/{MOST_STEPS**2}, found {text!r}")
    return step


def share_word(step: int) -> str:
    """What `share_step` makes it of."""
    return "whole" if step == 1 else f"1/{step**2}"


def shares_in_turn(count: int, step: int) -> list[Share]:
    """A share for each of `count` lights in their order: in each group of step² lights every share once, in random order.

    Lights of a Hammersley set that are close in direction differ in number by powers of two: shares in a fixed order would be the same for
    many neighbors, which then could not complement each other.
    """
    rng = np.random.default_rng(step)
    order = [rng.permutation(step**2) for _ in range(0, count, step**2)]
    return [Share(step, (int(k) % step, int(k) // step)) for group in order for k in group][:count]
