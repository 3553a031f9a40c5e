"""World normals of receivers that are scaled unevenly, sheared, mirrored or flattened: closed forms, and the light that falls on them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from conftest import Baked, built
from surfaces import check_normals

from srbf.bake.settings import BakeSettings, Receiver
from srbf.capture import Capture
from srbf.io.image import write_image

pytestmark = pytest.mark.blender

UNEVEN = np.diag([1.0, 2.0, 0.5])
FACET = 0.05  # degrees: a plane's normal, through a bake's float32
BENT = 0.3  # degrees in the median: Cycles interpolates normals in the world, where they differ in length
MOST_BENT = 5.0  # at worst: in the middle of a face near the egg's poles
SIDES = np.array([(0, -1, 1), (1, 0, 1), (0, 1, 1), (-1, 0, 1)]) / np.sqrt(2)  # of the pyramid, by quarter of its layer


def turn(x: float = 0.4, y: float = 0.7, z: float = 1.1) -> np.ndarray:
    """Blender's XYZ Euler rotation."""
    (a, b, c), (d, e, f) = np.cos([x, y, z]), np.sin([x, y, z])
    about_x = np.array([(1, 0, 0), (0, a, -d), (0, d, a)])
    about_y = np.array([(b, 0, e), (0, 1, 0), (-e, 0, b)])
    about_z = np.array([(c, -f, 0), (f, c, 0), (0, 0, 1)])
    return about_z @ about_y @ about_x


MATRICES = {
    "scaled": UNEVEN,
    "turned and scaled": turn() @ UNEVEN,
    "mirrored": turn() @ np.diag([-1.0, 2.0, 0.5]),
    "sheared": UNEVEN @ turn(),
    "sheared with hair": UNEVEN @ turn(),
    "instanced": UNEVEN @ turn(),
}


@pytest.fixture(scope="session")
def uneven(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    return built("uneven.py", tmp_path_factory)


def baked(scene: Path, folder: Path, receiver: str, **settings: object) -> Baked:
    small = {"width": 48, "height": 48, "lights": 6, "samples": 1, "validation": 0, "holdout": 0, "domain": "sphere"}
    return Baked(scene, folder, BakeSettings(Receiver.parse(receiver), **{**small, **settings}))


def degrees_between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    cross = np.linalg.norm(np.cross(a.astype(np.float64), b.astype(np.float64)), axis=-1)
    return np.degrees(np.arctan2(cross, (a * b).sum(axis=-1)))


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


@pytest.mark.parametrize("name", sorted(MATRICES))
def test_a_pyramids_normals_and_light(uneven, tmp_path: Path, name: str) -> None:
    """Each side's normal is M^-T n, outwards; alone and convex, it has irradiance N.L of every sun."""
    capture = baked(uneven(f"pyramid {name}"), tmp_path / "capture", "lightmap:" + ("Shown" if name == "instanced" else "Body")).capture
    normal, covered = capture.geometry("normal"), capture.coverage() > 0
    world = unit(SIDES @ np.linalg.inv(MATRICES[name]))
    rows, columns = np.nonzero(covered)
    expected = world[(columns >= 24) + 2 * (rows < 24)]
    assert len(rows) > 500
    assert degrees_between(normal[covered], expected).max() < FACET
    for index, light in enumerate(capture.lights):
        cosine = np.maximum(expected @ np.array(light.direction), 0)
        np.testing.assert_allclose(capture.image(index)[covered].mean(axis=1), cosine, rtol=2e-3, atol=2e-3)


def test_a_pyramid_without_height_looks_up(uneven, tmp_path: Path) -> None:
    capture = baked(uneven("pyramid flat"), tmp_path / "capture", "lightmap:Body").capture
    covered = capture.coverage() > 0
    assert degrees_between(capture.geometry("normal")[covered], np.array([0, 0, 1.0])).max() < FACET
    points = baked(uneven("pyramid flat"), tmp_path / "points", "vertices:Body", width=5, height=1).capture
    assert degrees_between(points.geometry("normal")[0], np.array([0, 0, 1.0])).max() < FACET


@pytest.mark.parametrize("receiver", ["lightmap:Body", "vertices:Body", "view"])
@pytest.mark.parametrize(
    ("name", "matrix"),
    [
        ("turned and scaled", turn() @ UNEVEN),
        ("mirrored", turn() @ np.diag([1.0, 2.0, -0.5])),
        ("sheared", turn() @ UNEVEN @ turn()),
    ],
)
def test_an_eggs_normals(uneven, tmp_path: Path, name: str, matrix: np.ndarray, receiver: str) -> None:
    """Points of an ellipsoid M s have the normal M^-T M^-1 p, outwards."""
    size = {"vertices:Body": (561, 1), "lightmap:Body": (48, 48), "view": (96, 96)}[receiver]
    quantity = "radiance" if receiver == "view" else "irradiance"
    capture = baked(uneven(f"egg {name}"), tmp_path / "capture", receiver, quantity=quantity, width=size[0], height=size[1]).capture
    covered = capture.coverage() >= 1
    back = np.linalg.inv(matrix)
    position = capture.geometry("position")[covered]
    expected = unit(position @ back.T @ back)
    angles = degrees_between(capture.geometry("normal")[covered], expected)
    if receiver == "view":  # from behind, at the open poles, a view's normals look inwards
        angles = np.minimum(angles, 180 - angles)
    assert covered.sum() > 100 and np.median(angles) < BENT and angles.max() < MOST_BENT


def test_the_check_of_every_bake_sees_normals_of_the_wrong_matrix(uneven, tmp_path: Path) -> None:
    capture = baked(uneven("pyramid scaled"), tmp_path / "capture", "lightmap:Body").capture
    check_normals(capture)
    of_inverse = unit(unit(SIDES @ np.linalg.inv(UNEVEN)) @ np.linalg.inv(UNEVEN).T @ np.linalg.inv(UNEVEN))
    rows, columns = np.indices(capture.coverage().shape)
    wrong = of_inverse[(columns >= 24) + 2 * (rows < 24)].astype(np.float32)
    write_image(capture.folder / "normal.exr", wrong, "float")
    with pytest.raises(AssertionError, match="flat texels have another normal"):
        check_normals(Capture.open(capture.folder))
