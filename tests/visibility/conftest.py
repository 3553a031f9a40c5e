"""The closed forms as fixtures."""

from __future__ import annotations

import numpy as np
import pytest
from closed_forms import ball, build_plane, quad

from srbf.io.scene_glb import KNOTS, Triangles
from srbf.visibility.receivers import Receivers


@pytest.fixture
def plane():
    return build_plane


@pytest.fixture
def roof() -> np.ndarray:
    """A half-plane 0.5 m above the ground, over x < 0."""
    return quad([-9, -9, 0.5], [0, -9, 0.5], [0, 9, 0.5], [-9, 9, 0.5])


@pytest.fixture
def pane() -> np.ndarray:
    """A pane 0.5 m above the ground, over x < 0, facing up."""
    return quad([-9, -9, 0.5], [0, -9, 0.5], [0, 9, 0.5], [-9, 9, 0.5])


@pytest.fixture
def sphere() -> np.ndarray:
    """A ball of radius 0.4 m, 0.6 m above the plane's middle."""
    return ball(0.4, [0, 0, 0.6])


@pytest.fixture
def smooth_ball() -> Receivers:
    """Points on a coarse unit ball of 16 steps with the round normals of its corners, scattered over its triangles."""
    corners = ball(1.0, [0, 0, 0], 16)
    real = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) > 1e-6
    corners = corners[real]
    normals = corners / np.linalg.norm(corners, axis=2, keepdims=True)
    rng = np.random.default_rng(3)
    bary = rng.dirichlet([1, 1, 1], (20, 20)).astype(np.float32)
    chosen = rng.integers(0, len(corners), (20, 20))
    position = np.einsum("hwk,hwkc->hwc", bary, corners[chosen])
    normal = np.einsum("hwk,hwkc->hwc", bary, normals[chosen])
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    triangles = Triangles(
        corners,
        normals.astype(np.float32),
        np.zeros(len(corners), int),
        np.ones(len(corners), bool),
        np.zeros((1, KNOTS, 3), np.float32),
    )
    images = {"position": position.astype(np.float32), "normal": normal.astype(np.float32)}
    return Receivers(20, 20, "irradiance", images, triangles, {"sun_angle": 0.0, "footprint": 1e-6})
