"""View bakes by real Cycles: every camera kind, coverage, positions that reproject, radiance and irradiance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

pytestmark = pytest.mark.blender

ALBEDO = np.array([0.8, 0.4, 0.2])
REPROJECTION = 0.02  # pixels


def test_radiance_is_albedo_cosine_over_pi_and_unpremultiplied(bake) -> None:
    capture = bake("view", "view", width=40, height=30, samples=16, holdout_samples=64).capture
    coverage = capture.coverage()
    assert 0.05 < (coverage == 1).mean() < 0.95 and (coverage == 0).any() and ((coverage > 0) & (coverage < 1)).any()
    assert capture.quantity == "radiance" and capture.manifest["receiver"] == {"kind": "view", "camera": "Camera"}
    interior = ndimage.binary_erosion(coverage == 1)  # where no sample of any image misses
    for index, light in enumerate(capture.lights):
        image = capture.image(index)[interior]
        np.testing.assert_allclose(image, np.broadcast_to(ALBEDO * light.direction[2] / np.pi, image.shape), rtol=2e-3)
    edge = (coverage > 0.1) & (coverage < 0.9)
    # Unpremultiplied and unbiased: pixels covered in part show the surface's own radiance, on the mean of their few samples.
    ratios = [capture.image(i)[edge] / (ALBEDO * light.direction[2] / np.pi) for i, light in enumerate(capture.lights)]
    assert np.average(np.mean(ratios, axis=(0, 2)), weights=coverage[edge]) == pytest.approx(1, abs=0.02)
    np.testing.assert_allclose(capture.geometry("albedo")[coverage == 1], np.broadcast_to(ALBEDO, ((coverage == 1).sum(), 3)), rtol=0.01)


def test_irradiance_of_a_view_has_no_albedo(bake) -> None:
    capture = bake("view", "view", quantity="irradiance").capture
    inside = capture.coverage() == 1
    for index, light in enumerate(capture.lights):
        np.testing.assert_allclose(capture.image(index)[inside], light.direction[2], rtol=2e-3)


def reproject(kind: str, points: np.ndarray, camera: dict, width: int, height: int) -> np.ndarray:
    """(column, row) of world points, pixel centers at +1/2, for Blender's camera of each kind."""
    view = np.linalg.inv(np.array(camera["matrix_world"]))
    p = points @ view[:3, :3].T + view[:3, 3]  # camera looks down -z, y up
    if kind == "pano":
        azimuth, elevation = np.arctan2(p[:, 0], -p[:, 2]), np.arcsin(p[:, 1] / np.linalg.norm(p, axis=1))
        return np.stack([(azimuth / (2 * np.pi) + 0.5) * width, (0.5 - elevation / np.pi) * height], axis=1)
    extent = camera["ortho_scale"] if kind == "ortho" else 2 * np.tan(camera["angle_x"] / 2)
    xy = p[:, :2] if kind == "ortho" else p[:, :2] / -p[:, 2:]
    return np.stack([width / 2 + xy[:, 0] / extent * width, height / 2 - xy[:, 1] / extent * width], axis=1)


@pytest.mark.parametrize("kind", ["view", "ortho", "pano"])
def test_positions_reproject_onto_their_pixels(bake, kind: str) -> None:
    width, height = (160, 80) if kind == "pano" else (40, 30)
    capture = bake(kind, "view:Camera", width=width, height=height, lights=2).capture
    inside = capture.coverage() == 1
    assert inside.sum() > 20
    points = capture.geometry("position")[inside]
    np.testing.assert_allclose(points[:, 2], 0, atol=1e-4)
    rows, columns = np.nonzero(inside)
    got = reproject(kind, points.astype(np.float64), capture.manifest["source"]["camera"], width, height)
    np.testing.assert_allclose(got, np.stack([columns + 0.5, rows + 0.5], axis=1), atol=REPROJECTION)
