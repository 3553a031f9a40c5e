"""Normals of a capture against the slope of its own positions: a check that every bake of the tests passes through."""

from __future__ import annotations

import numpy as np

from srbf.capture import Capture

FLAT = np.cos(np.radians(0.2))  # neighbors whose normals differ by less lie on one plane
OFF = 1.0  # degrees between a plane's normal and the slope of its positions, in all but SPOILED of the texels
SPOILED = 0.02  # whose neighbors are another chart's
BEND = 10.0  # degrees in the median where normals bend: coarse smooth meshes differ from their facets by half a facet's bend
FEWEST = 40  # texels to judge by


def slopes(position: np.ndarray, covered: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """((H - 2, W - 2, 3) unit normals of either sign from central differences of positions, where all four neighbors are covered)."""
    right, up = position[1:-1, 2:] - position[1:-1, :-2], position[:-2, 1:-1] - position[2:, 1:-1]
    normal = np.cross(right.astype(np.float64), up.astype(np.float64))
    size = np.linalg.norm(normal, axis=2)
    inside = covered[1:-1, 1:-1] & covered[1:-1, 2:] & covered[1:-1, :-2] & covered[:-2, 1:-1] & covered[2:, 1:-1]
    lengths = np.linalg.norm(right, axis=2) * np.linalg.norm(up, axis=2)
    return normal / np.maximum(size, 1e-20)[..., None], inside & (size > 1e-3 * lengths) & (lengths > 0)


def check_normals(capture: Capture) -> None:
    """AssertionError where the normals of a lightmap's or a view's capture are not those of its surface."""
    position, normal = capture.geometry("position"), capture.geometry("normal")
    if position is None or normal is None or (capture.manifest.get("receiver") or {}).get("kind") == "vertices":
        return
    slope, known = slopes(position, capture.coverage() >= 1)
    middle = normal[1:-1, 1:-1]
    level = known.copy()
    for neighbor in (normal[1:-1, 2:], normal[1:-1, :-2], normal[:-2, 1:-1], normal[2:, 1:-1]):
        level &= (neighbor * middle).sum(axis=2) > FLAT
    angle = np.degrees(np.arccos(np.clip(np.abs((slope * middle).sum(axis=2)), 0, 1)))
    if level.sum() >= FEWEST:
        assert (angle[level] > OFF).mean() <= SPOILED, f"{(angle[level] > OFF).mean():.1%} of flat texels have another normal"
    if known.sum() >= FEWEST:
        assert np.median(angle[known]) <= BEND, f"normals are {np.median(angle[known]):.1f} degrees off in the median"
