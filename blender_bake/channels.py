# SPDX-License-Identifier: GPL-3.0-or-later
"""The channels and masks of a receiver, by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from blender_bake.ipc import WorkerError

Makers = Mapping[str, Callable[[], "np.ndarray | None"]]  # by name; None: the receiver has no such image


def chosen(names: list[str], makers: Makers, kind: str) -> dict[str, np.ndarray]:
    """The images (H, W, C) float32 of `names`, of a receiver of that `kind`; WorkerError for a name that it cannot render."""
    if unknown := [name for name in names if name not in makers]:
        raise WorkerError(f"expected channels among {', '.join(makers)} of a {kind}, found a job that asks for {', '.join(unknown)}")
    images = {name: makers[name]() for name in names}
    return {name: image for name, image in images.items() if image is not None}
