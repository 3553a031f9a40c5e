"""Outlines: the pixels of a view where surfaces meet or hide each other."""

import numpy as np

from srbf.visibility.outlines import outlines


def plane(height: float, width: int = 6) -> tuple[np.ndarray, np.ndarray]:
    """Positions and normals of a floor at a height, seen from above, a pixel a meter wide."""
    y, x = np.mgrid[0:width, 0:width].astype(np.float32)
    return np.stack([x, y, np.full_like(x, height)], axis=2), np.broadcast_to(np.array([0, 0, 1], np.float32), (width, width, 3)).copy()


def test_one_plane_has_none() -> None:
    assert not outlines(*plane(0.0)).any()


def test_a_step_is_found_on_both_sides() -> None:
    position, normal = plane(0.0)
    position[:, 3:, 2] = 0.5
    found = outlines(position, normal)
    assert found[:, 2:4].all() and not found[:, :2].any() and not found[:, 4:].any()


def test_a_crease_is_found_by_its_normals() -> None:
    position, normal = plane(0.0)
    normal[2:, :] = [0, np.sqrt(0.5), np.sqrt(0.5)]
    assert outlines(position, normal)[1:3].all()
