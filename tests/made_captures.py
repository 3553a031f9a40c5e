"""Captures written to disk whose images are functions of the light direction."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from srbf.capture import Capture
from srbf.io import files
from srbf.io.image import write_image
from srbf.sphere import point_set, random_directions

Response = Callable[[np.ndarray], np.ndarray]  # (3,) direction -> (H, W, 3) image


def write_capture(
    folder: Path,
    response: Response,
    lights: int = 60,
    holdout: int = 8,
    domain: str = "hemisphere",
    encoding: str = "float",
    directions: np.ndarray | None = None,
    validation: int = 0,
    **images: np.ndarray,
) -> Capture:
    """A capture in `folder` of `lights` on the domain, or of `directions`, and of random ones to validate and to hold out."""
    (folder / "lights").mkdir(parents=True)
    train = point_set("hammersley", lights, domain) if directions is None else directions
    groups = [
        ("train", train),
        ("validation", random_directions(validation, domain, np.random.default_rng(8))),
        ("holdout", random_directions(holdout, domain, np.random.default_rng(7))),
    ]
    entries = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda descriptor: None)  # a millisecond or more a file, and nobody pulls the plug
        for role, chosen in groups:
            for direction in chosen:
                file = f"lights/{len(entries):04d}.exr"
                pixels = response(direction).astype(np.float32)
                write_image(folder / file, pixels, encoding)
                entries.append({"kind": "directional", "direction": direction.tolist(), "role": role, "file": file})
        for image, values in images.items():
            write_image(folder / f"{image}.exr", values, "float")
    height, width = pixels.shape[:2]
    manifest = {
        "format": "srbf-capture",
        "version": 1,
        "quantity": "irradiance",
        "width": width,
        "height": height,
        "lights": entries,
        **{image: f"{image}.exr" for image in images},
    }
    files.write_json(folder / "capture.json", manifest)
    return Capture.open(folder)
